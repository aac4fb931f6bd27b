//! A law that follows the position of the joints of its plant: the same design at points over half a turn.

use dashu_int::UBig;
use kardan_rt::{Bounds, Gain, Health, RegulatorState, Schedule, ScheduledRegulator, Sensor};

use super::{RegulatorData, sensors_in};
use kardan_math::num::{Float, Matrix, Rational, Scalar};
use kardan_mechanics::reduce::{Kinematics, MechanismData, Reduced, Step};

/// The turn after which the ratio of a universal joint repeats, rad.
pub(crate) const PERIOD: f64 = std::f64::consts::PI;

/// The numbers of the block [`ScheduledRegulator`].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ScheduleData {
    /// Number of the reduced coordinate that it follows.
    pub coordinate: usize,
    /// The design at each point, at equal distances over [`PERIOD`]; all of the same shape, the first one straight ahead.
    pub points: Vec<RegulatorData>,
    pub mechanism: MechanismData<f64>,
    /// The readings of the sensors, less those at zero coordinates.
    pub sensors: Vec<Sensor<f64>>,
    pub entries: Vec<(usize, f64)>,
}

/// The coordinate that all joints of a model turn with, so that what they do to it is periodic in that angle alone.
///
/// # Errors
/// Why there is none, as the end of a sentence.
pub(crate) fn turning(reduced: &Reduced) -> Result<usize, String> {
    let (n, r) = (reduced.equations.coordinates.len(), reduced.degrees_of_freedom());
    let names = reduced.coordinate_names();
    // How often each shaft turns, on the whole, with each coordinate, and whether it depends on it at all.
    let mut turns = vec![vec![Rational::ZERO; r]; n];
    let mut depends = vec![vec![false; r]; n];
    for (column, &shaft) in reduced.coordinates.iter().enumerate() {
        turns[shaft][column] = Rational::ONE;
        depends[shaft][column] = true;
    }
    let mut found: Option<usize> = None;
    for Step { shaft, argument, curve } in &reduced.steps {
        let turns_of = |column: usize| {
            argument.terms.iter().fold(Rational::ZERO, |sum, (shaft, x)| sum.plus(&x.times(&turns[*shaft][column])))
        };
        let own_turns: Vec<Rational> = (0..r).map(turns_of).collect();
        let own: Vec<bool> = (0..r).map(|k| argument.terms.iter().any(|(shaft, _)| depends[*shaft][k])).collect();
        if let Some(curve) = curve {
            let name = &reduced.equations.coordinates[*shaft];
            if !curve.repeats_each_half_turn() {
                return Err(format!(
                    "the transmission that gives the angle of `{name}` does not repeat after half a turn"
                ));
            }
            for column in (0..r).filter(|k| own[*k]) {
                let before = *found.get_or_insert(column);
                if before != column {
                    return Err(format!(
                        "its joints turn with two coordinates, `{}` and `{}`",
                        names[before], names[column]
                    ));
                }
                if *own_turns[column].denominator() != UBig::ONE {
                    return Err(format!(
                        "the joint of `{name}` turns with `{}` through a gear whose ratio is not a whole number",
                        names[column]
                    ));
                }
            }
        }
        turns[*shaft] = own_turns;
        depends[*shaft] = own;
    }
    let kinematics = Kinematics::new(reduced);
    let springs = &reduced.equations.springs;
    let bent = springs.iter().find(|spring| spring.row.iter().any(|(shaft, _)| kinematics.is_varying(*shaft)));
    if let Some(spring) = bent {
        return Err(format!("the spring of `{}` acts through a joint", spring.element));
    }
    found.ok_or_else(|| "it has no bent joint".into())
}

impl ScheduleData {
    /// One row of numbers for each point.
    pub fn rows(&self) -> Vec<Vec<f64>> {
        self.points.iter().map(RegulatorData::numbers).collect()
    }

    /// Names and shapes of what a row consists of.
    pub fn layout(&self) -> Vec<(&'static str, usize, usize)> {
        let names = [
            "prediction",
            "input",
            "output",
            "correction",
            "feedback",
            "force_input",
            "on_forces",
            "governor on_state",
            "governor on_model",
            "governor on_references",
        ];
        let parts = self.points.first().map(RegulatorData::parts).unwrap_or_default();
        names.into_iter().zip(parts).map(|(name, part)| (name, part.rows(), part.columns())).collect()
    }

    /// The law at an angle of the coordinate, rad, as the block takes it from the points; without governor. `None` if the angle is
    /// not finite.
    pub fn at(&self, angle: f64) -> Option<RegulatorData> {
        let straight = self.points.first()?;
        let mut numbers = straight.numbers();
        let rows: Vec<f64> = self.rows().concat();
        if !Schedule::new(&rows, numbers.len(), PERIOD)?.at(angle, &mut numbers) {
            return None;
        }
        let mut first = 0;
        let mut parts = straight.parts().into_iter().map(|part| {
            let start = first;
            first += part.rows() * part.columns();
            Matrix::from_fn(part.rows(), part.columns(), |i, j| numbers[start + i * part.columns() + j])
        });
        let mut next = || parts.next();
        // In the order of the parts.
        Some(RegulatorData {
            prediction: next()?,
            input: next()?,
            output: next()?,
            correction: next()?,
            feedback: next()?,
            force_input: next()?,
            on_forces: next()?,
            governor: None,
            ..straight.clone()
        })
    }

    /// By how much the feedback between two points may differ from a design there, over its largest gain of the same motor: an
    /// eighth of second differences, the error of a straight line through a smooth curve.
    pub fn interpolation_error(&self) -> f64 {
        let count = self.points.len();
        let feedback = |k: usize| &self.points[k % count].feedback;
        let mut worst = 0.0f64;
        for k in 0..count {
            for i in 0..feedback(k).rows() {
                let largest = feedback(k).row(i).iter().fold(0.0f64, |max, x| max.max(x.abs()));
                for j in 0..feedback(k).columns() {
                    let [a, b, c] = [k, k + 1, k + 2].map(|k| feedback(k)[(i, j)]);
                    worst = worst.max((a - 2.0 * b + c).abs() / 8.0 / largest);
                }
            }
        }
        worst
    }
}

/// The block [`ScheduledRegulator`] in a precision, without the data that all points share.
#[derive(Debug, Clone)]
pub(crate) struct Scheduled<T> {
    rows: Vec<T>,
    width: usize,
    coordinate: usize,
    mechanism: MechanismData<T>,
    sensors: Vec<Sensor<T>>,
    entries: Vec<(usize, T)>,
    scratch: Vec<T>,
}

impl<T: Float> Scheduled<T> {
    pub fn new(data: &ScheduleData) -> Self {
        let rows = data.rows();
        let (sensors, entries) = sensors_in(&data.sensors, &data.entries);
        let (width, mechanism) = (rows.first().map_or(0, Vec::len), data.mechanism.cast(T::from_f64));
        let coordinates = data.points.first().map_or(0, |point| point.on_forces.columns());
        let scratch = width + data.sensors.len() + coordinates + mechanism.block().memory();
        Self {
            rows: T::list(&rows.concat()),
            width,
            coordinate: data.coordinate,
            mechanism,
            sensors,
            entries,
            scratch: vec![T::ZERO; scratch],
        }
    }

    /// One sample on readings and references; `None` if there is no schedule.
    pub fn step(
        &mut self,
        (model, model_input): (Gain<'_, T>, Gain<'_, T>),
        bounds: &[Bounds<T>],
        governor_bounds: &[T],
        (readings, references): (&[T], &[T]),
        memory: RegulatorState<'_, T>,
    ) -> Option<Health> {
        let block = ScheduledRegulator {
            schedule: Schedule::new(&self.rows, self.width, T::from_f64(PERIOD))?,
            coordinate: self.coordinate,
            model,
            model_input,
            bounds,
            governor_bounds,
            mechanism: self.mechanism.block(),
            sensors: &self.sensors,
            entries: &self.entries,
        };
        Some(block.step(readings, references, memory, &mut self.scratch))
    }
}
