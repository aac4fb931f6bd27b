//! A sensor in a run: what it measures, its resolution, phase and zero-order hold.

use super::counts::Notes;
use kardan_math::num::{Random, Rational, StateArchive, rational_to_f64};
use kardan_math::units::Exact;
use kardan_mechanics::assemble::DirectionalTerm;
use kardan_mechanics::equations::{Measured, Sensor};
use kardan_mechanics::reduce::{Dynamics, Reduced, Work};

/// A time between two readings or samples, s, as a quotient of integers, so that samples coincide exactly with rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Period {
    numerator: f64,
    denominator: f64,
}

impl Period {
    pub fn new(time: &Exact) -> Self {
        let time = time.to_rational();
        let whole = |x: Rational| rational_to_f64(&x);
        Self {
            numerator: whole(time.numerator().clone().into()),
            denominator: whole(time.denominator().clone().into()),
        }
    }

    /// A period in s that is given only as a floating-point number: the reciprocal of an integer, if it is one.
    pub fn of(seconds: f64) -> Self {
        let rate = (1.0 / seconds).round();
        if rate >= 1.0 && 1.0 / rate == seconds {
            return Self { numerator: 1.0, denominator: rate };
        }
        Self { numerator: seconds, denominator: 1.0 }
    }

    /// The time of a sample, s.
    pub fn at(self, sample: u64) -> f64 {
        sample as f64 * self.numerator / self.denominator
    }
}

/// A sensor with its last reading (zero-order hold).
#[derive(Debug, Clone, Default)]
pub(super) struct Sampler {
    /// Its counting step, SI, and the scale of its output: torque per twist where it measures a torque by a twist, else
    /// 1.
    pub resolution: Option<f64>,
    pub stiffness: f64,
    /// The position of the sensor's zero within a step, 0 to 1.
    phase: f64,
    period: Option<Period>,
    differentiate: bool,
    next: u64,
    last_angle: f64,
    /// Standard deviation and random source; every sampler of one sensor draws the same values.
    noise: Option<(f64, Random)>,
    /// Its readings, where they are recorded.
    pub notes: Option<Box<Notes>>,
    /// Its reading.
    pub zoh_output: f64,
}

impl Sampler {
    /// A sensor without resolution, noise or delay.
    pub fn ideal() -> Self {
        Self { stiffness: 1.0, last_angle: f64::NAN, ..Self::default() }
    }

    /// A sensor; `stiffness` is torque per twist for one that measures a torque by a twist, else 1. Its noise depends on its name
    /// and the seed alone.
    pub fn new(name: &str, sensor: &Sensor, stiffness: f64, seed: u64) -> Self {
        Self {
            resolution: sensor.resolution,
            stiffness,
            phase: sensor.phase,
            period: sensor.sample_time.as_ref().map(Period::new),
            differentiate: Self::differentiates(sensor),
            noise: sensor.noise.map(|noise| (noise, Random::named(seed, name))),
            ..Self::ideal()
        }
    }

    /// Reseeds its noise, by its name and the seed.
    pub fn draw_anew(&mut self, name: &str, seed: u64) {
        if let Some((_, random)) = &mut self.noise {
            *random = Random::named(seed, name);
        }
    }

    /// Whether it has no resolution, noise or delay.
    pub fn is_ideal(&self) -> bool {
        self.resolution.is_none() && self.period.is_none() && self.noise.is_none()
    }

    /// Whether a speed is the difference of rounded angles.
    pub fn differentiates(sensor: &Sensor) -> bool {
        matches!(sensor.measured, Measured::Speed(_)) && sensor.resolution.is_some()
    }

    /// The time of the next reading, s; none for a sensor that reads at every instant.
    pub fn next_time(&self) -> Option<f64> {
        self.period.map(|period| period.at(self.next))
    }

    /// The state that its next readings depend on.
    pub fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.word(&mut self.next);
        archive.number(&mut self.last_angle);
        archive.number(&mut self.zoh_output);
        if let Some((_, random)) = &mut self.noise {
            random.archive_state(archive);
        }
    }

    /// Reads if it is time.
    pub fn sample(&mut self, time: f64, exact: impl FnOnce() -> f64) {
        if self.next_time().is_some_and(|next| next > time) {
            return;
        }
        let noise = self.noise.as_mut().map_or(0.0, |(size, random)| *size * random.normal());
        let exact = if self.differentiate { exact() } else { exact() + noise };
        let mut count = |steps: f64| self.notes.as_mut().map_or(steps.floor(), |notes| notes.count(time, steps));
        let step = self.resolution.map(|resolution| resolution * self.stiffness);
        let rounded = step.map_or(exact, |step| count(exact / step + self.phase) * step);
        self.zoh_output = if self.differentiate {
            let before = if self.last_angle.is_nan() { rounded } else { self.last_angle };
            self.last_angle = rounded;
            (rounded - before) / self.period.map_or(1.0, |period| period.at(1)) + noise
        } else {
            rounded
        };
        self.next += 1;
    }
}

/// The quantity of a signal or a sensor.
#[derive(Debug, Clone)]
pub(super) enum Read {
    Angle(usize),
    Speed(usize),
    Torque(usize),
    Command(usize),
    Ripple(usize),
    Multiplier(usize),
    NetTorque(usize),
    ConstraintTorque(usize, usize),
    /// Sum of multipliers, each times a number.
    Potentials(Vec<(usize, f64)>),
    SpringDamper {
        springs: Vec<usize>,
        dampers: Vec<usize>,
    },
    Compliance(Compliance),
    Friction(usize),
    /// Sum of the torques of directions, each times a number: of unilateral constraints, or of the independent multiplier
    /// constraints that one is a sum of.
    Frictions(Vec<(usize, f64)>),
    /// The torque of a multiplier constraint on a shaft: first its row as a sum of independent rows.
    MultiplierOn(Vec<(usize, f64)>, Vec<(usize, f64)>, usize),
    Law(usize),
    Source(usize),
    Sensor(usize),
}

/// The torque of a compliant element times a factor: by springs and dampers, by number.
#[derive(Debug, Clone)]
pub(super) struct Compliance {
    pub(super) springs: Vec<usize>,
    pub(super) dampers: Vec<usize>,
    pub(super) factor: f64,
}

impl Compliance {
    /// The torque on a shaft, or the multiplier; `None` if the element is not compliant or does not act there.
    pub fn new(reduced: &Reduced, element: &str, shaft: Option<usize>) -> Option<Self> {
        let equations = &reduced.equations;
        let compliance = equations.compliances.iter().find(|compliance| compliance.element == element)?;
        let share = match shaft {
            Some(shaft) => compliance.row_f64().into_iter().find(|(k, _)| *k == shaft)?.1,
            None => 1.0,
        };
        Some(Self {
            springs: numbers_of(element, &equations.springs),
            dampers: numbers_of(element, &equations.dampers),
            factor: share / compliance.value.to_f64(),
        })
    }

    fn read(&self, dynamics: &Dynamics, work: &Work) -> f64 {
        let springs: f64 = self.springs.iter().map(|&k| dynamics.spring_torque(k, work)).sum();
        let dampers: f64 = self.dampers.iter().map(|&k| dynamics.damper_torque(k, work)).sum();
        self.factor * (springs + dampers)
    }
}

impl Read {
    /// What a sensor measures; `None` for a signal that has no number by `source`. A speed that the sensor
    /// `differentiates` is read as an angle.
    pub fn of(
        measured: &Measured,
        reduced: &Reduced,
        differentiates: bool,
        source: impl Fn(&str) -> Option<usize>,
    ) -> Option<Self> {
        let shaft = |name: &String| reduced.coordinate(name).expect("a sensor names a shaft");
        Some(match measured {
            Measured::Speed(name) if !differentiates => Self::Speed(shaft(name)),
            Measured::Angle(name) | Measured::Speed(name) => Self::Angle(shaft(name)),
            Measured::SpringTorque(element) => {
                Self::SpringDamper { springs: numbers_of(element, &reduced.equations.springs), dampers: Vec::new() }
            }
            Measured::NetTorque(name) => Self::NetTorque(shaft(name)),
            Measured::ComplianceTorque(element, name) => {
                let torque = Compliance::new(reduced, element, Some(shaft(name)));
                Self::Compliance(torque.expect("a sensor names a compliance"))
            }
            Measured::ConstraintTorque(element, name) => {
                let mut elements = reduced.constraint_elements().into_iter();
                let k = elements.position(|e| e == element).expect("a sensor names a constraint");
                Self::ConstraintTorque(k, shaft(name))
            }
            Measured::Signal(name) => Self::Source(source(name)?),
        })
    }

    /// The value now of what a law measures, of whose references a source is one.
    ///
    /// # Panics
    /// If it depends on accelerations (the design of the law rejects that).
    pub fn now(&self, (dynamics, work): (&Dynamics, &Work), references: &[f64]) -> f64 {
        match self {
            Self::Source(k) => references[*k],
            Self::Angle(shaft) => work.kinematics.angles[*shaft],
            Self::Speed(shaft) => work.kinematics.speeds[*shaft],
            Self::SpringDamper { springs, .. } => springs.iter().map(|&k| dynamics.spring_torque(k, work)).sum(),
            Self::Compliance(compliance) => compliance.read(dynamics, work),
            other => unreachable!("no law measures {other:?}"),
        }
    }
}

/// Numbers of the terms of an element.
pub(super) fn numbers_of<T>(element: &str, terms: &[DirectionalTerm<T>]) -> Vec<usize> {
    terms.iter().enumerate().filter(|(_, term)| term.element == element).map(|(k, _)| k).collect()
}

/// Torque per twist of the springs of an element, N m/rad.
pub(super) fn stiffness(reduced: &Reduced, measured: &Measured) -> f64 {
    let Measured::SpringTorque(element) = measured else { return 1.0 };
    let springs = reduced.equations.springs.iter().filter(|spring| spring.element == *element);
    springs.map(|spring| spring.value.stiffness.to_f64()).sum()
}
