//! Mapping of log channels to signals of the model.

use crate::study::read::read_values::{key_error, quantity, read_word};
use kardan_math::names::{did_you_mean, unknown_name};
use kardan_math::units::{Dimension, Exact, header_unit};
use kardan_mechanics::equations::Domain;
use kardan_mechanics::equations::{Direction, Measured, Term};
use kardan_model::{Model, TableReader};
use kardan_results::signal_name;
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::schema::{Sign, Table};
use kardan_tables::read::Group;

/// `cos nφ` or `sin nφ` of a measured angle.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Harmonic {
    pub shaft: String,
    /// n
    pub order: f64,
    pub sine: bool,
}

/// A measured quantity, or a quantity computed from one sample by sample.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Quantity {
    /// Of a shaft, or the position of a mass.
    Angle(String, Domain),
    /// Of a shaft, or the velocity of a mass.
    Speed(String, Domain),
    /// Of an input, or its force.
    Torque(String, Domain),
    /// Of an angle: it passes the same filter as the torque, so that windows may contain many of its periods.
    Harmonic(Harmonic),
}

impl Quantity {
    pub fn dimension(&self) -> Dimension {
        match self {
            Self::Angle(_, domain) => domain.dimensions()[0],
            Self::Speed(_, domain) => domain.dimensions()[1],
            Self::Torque(_, Domain::Translation) => Dimension::FORCE,
            Self::Torque(..) => Dimension::TORQUE,
            Self::Harmonic(_) => Dimension::NONE,
        }
    }

    pub fn unit(&self) -> &'static str {
        match self {
            Self::Angle(_, domain) => domain.motion()[0].unit(),
            Self::Speed(_, domain) => domain.motion()[1].unit(),
            Self::Torque(_, domain) => domain.effort().unit(),
            Self::Harmonic(_) => "1",
        }
    }

    /// Whether it is the angle of a shaft, or the position of a mass.
    pub fn is_angle_of(&self, shaft: &str) -> bool {
        matches!(self, Self::Angle(own, _) if own == shaft)
    }

    /// Whether it is the speed of a shaft or a mass.
    pub fn is_speed_of(&self, shaft: &str) -> bool {
        matches!(self, Self::Speed(own, _) if own == shaft)
    }

    /// Whether it is the torque or the force of an input.
    pub fn is_torque_of(&self, input: &str) -> bool {
        matches!(self, Self::Torque(own, _) if own == input)
    }

    pub fn signal(&self) -> String {
        match self {
            Self::Angle(shaft, domain) => domain.motion()[0].of(shaft),
            Self::Speed(shaft, domain) => domain.motion()[1].of(shaft),
            Self::Torque(input, domain) => domain.effort().of(input),
            Self::Harmonic(Harmonic { shaft, order, sine }) => {
                format!("{}({order} {})", if *sine { "sin" } else { "cos" }, signal_name::Quantity::Angle.of(shaft))
            }
        }
    }
}

/// A channel that is read.
#[derive(Debug, Clone)]
pub(super) struct MappedChannel {
    pub group: usize,
    pub channel: usize,
    pub quantity: Quantity,
    /// Factor from a reading to SI.
    pub factor: f64,
    /// First samples whose mean is subtracted.
    pub zero_samples: usize,
    /// Stated standard deviation of a sample, SI.
    pub noise: Option<f64>,
}

/// The domain of a coordinate of a model.
fn domain_of(model: &Model, coordinate: &str) -> Domain {
    let own = model.terms.iter().find_map(|named| match &named.term {
        Term::Coordinate { name, domain: domain @ (Domain::Translation | Domain::Charge) } if name == coordinate => {
            Some(*domain)
        }
        _ => None,
    });
    own.unwrap_or_default()
}

/// The domain of the first coordinate of a direction.
fn domain_of_direction(model: &Model, direction: &Direction) -> Domain {
    direction.entries.first().map_or(Domain::Rotation, |(name, _)| domain_of(model, name))
}

/// The quantity that a signal means, and the step of its sensor (rad), if it has one.
pub(super) fn quantity_of(signal: &str, model: &Model) -> Option<(Quantity, Option<f64>)> {
    let name = SignalName::new(signal);
    let (head, quantity) = (name.unqualified()?, name.quantity());
    if model.all_coordinates.iter().any(|shaft| shaft == head) {
        let (shaft, domain) = (head.to_string(), domain_of(model, head));
        match quantity {
            Some(signal_name::Quantity::Angle | signal_name::Quantity::Position) => {
                return Some((Quantity::Angle(shaft, domain), None));
            }
            Some(signal_name::Quantity::Speed | signal_name::Quantity::Velocity) => {
                return Some((Quantity::Speed(shaft, domain), None));
            }
            _ => {}
        }
    }
    model.terms.iter().filter(|named| named.element == head).find_map(|named| match &named.term {
        Term::Input { direction, .. }
            if name.is(signal_name::Quantity::Torque) || name.is(signal_name::Quantity::Force) =>
        {
            Some((Quantity::Torque(head.to_string(), domain_of_direction(model, direction)), None))
        }
        Term::Output(sensor) => match &sensor.measured {
            Measured::Angle(shaft) if name.word.is_none() || name.is_position() => {
                Some((Quantity::Angle(shaft.clone(), domain_of(model, shaft)), sensor.resolution))
            }
            Measured::Speed(shaft) if name.word.is_none() || name.is_rate() => {
                Some((Quantity::Speed(shaft.clone(), domain_of(model, shaft)), None))
            }
            _ => None,
        },
        _ => None,
    })
}

/// All signals to which a channel may be mapped.
pub(super) fn signals(model: &Model) -> Vec<String> {
    let motion = |shaft: &String| domain_of(model, shaft).motion().map(|quantity| quantity.of(shaft));
    let shafts = model.all_coordinates.iter().flat_map(motion);
    let inputs = model.terms.iter().filter_map(|named| match &named.term {
        Term::Input { direction, .. } => Some(domain_of_direction(model, direction).effort().of(&named.element)),
        _ => None,
    });
    shafts.chain(inputs).collect()
}

pub(super) fn number(table: &Table, key: &str, reader: &TableReader<'_>, out: &mut Vec<Diagnostic>) -> Option<f64> {
    quantity(reader, table, key, (Dimension::NONE, Sign::Any), "a log", out).map(|x| x.to_f64())
}

/// A file with the table that describes it.
#[derive(Clone, Copy)]
pub(super) struct Described<'a, 'd> {
    pub table: &'a Table,
    pub file: &'a str,
    pub groups: &'a [Group],
    pub reader: &'a TableReader<'d>,
}

/// Maps columns that are named like a signal.
pub(super) fn wire_by_name(
    Described { file, groups, .. }: Described<'_, '_>,
    model: &Model,
    mapped: &mut Vec<MappedChannel>,
    out: &mut Vec<Diagnostic>,
) {
    for (group, own) in groups.iter().enumerate() {
        for (channel, named) in own.channels.iter().enumerate() {
            // In MAT files names cannot have points: wg_motor_tau.
            let pointed = named.name.rsplit_once('_').map(|(head, tail)| format!("{head}.{tail}"));
            let matched = quantity_of(&named.name, model).or_else(|| quantity_of(&pointed?, model));
            let Some((quantity, _)) = matched else { continue };
            if mapped.iter().any(|candidate| candidate.quantity == quantity) {
                continue;
            }
            match unit_factor(&named.unit, &quantity) {
                Ok(factor) => {
                    mapped.push(MappedChannel { group, channel, quantity, factor, zero_samples: 0, noise: None })
                }
                Err(why) => out.push(
                    Diagnostic::error(
                        "unit::dimension",
                        format!("`{file}`, channel `{}`: {why}", shortened(&named.name)),
                    )
                    .help("describe it in `[[log.NAME.channel]]` with `signal`, `column` and `unit`"),
                ),
            }
        }
    }
}

/// Factor from a reading in a unit to SI.
fn unit_factor(unit: &str, quantity: &Quantity) -> Result<f64, String> {
    let unit = unit.trim();
    let per_minute = Exact::from_ratio(1, 60);
    let is_turning = matches!(quantity, Quantity::Speed(..)) && quantity.dimension() == Dimension::ANGULAR_VELOCITY;
    match header_unit(unit) {
        Ok((factor, dimension)) if dimension == quantity.dimension() => Ok(factor.to_f64()),
        Ok((factor, Dimension::NONE)) if factor == Exact::one() => Ok(1.0),
        Ok((factor, dimension)) if is_turning && dimension == Dimension::FREQUENCY => {
            match factor == per_minute {
                // Radians per minute is not a usual unit.
                true => Ok(header_unit("rpm").map_or(1.0, |(factor, _)| factor.to_f64())),
                false => Err(format!(
                    "`{}` is a speed, and `{unit}` may mean revolutions or radians per time: write `rev/s` or `rad/s`",
                    quantity.signal()
                )),
            }
        }
        Ok((_, dimension)) => Err(format!(
            "`{}` is {}, but the unit `{unit}` is that of {}",
            quantity.signal(),
            quantity.dimension().noun(),
            dimension.noun()
        )),
        Err(_) => Err(format!("kardan does not know the unit `{}`", shortened(unit))),
    }
}

/// Names of the channels of a file.
pub(super) fn channel_names(groups: &[Group]) -> Vec<&str> {
    groups.iter().flat_map(|group| group.channels.iter().map(|channel| channel.name.as_str())).collect()
}

/// The channel of a file that a name or number means.
pub(super) fn find(groups: &[Group], name: Option<&str>, number: Option<usize>) -> Option<(usize, usize)> {
    if let Some(number) = number {
        let mut before = 0;
        for (group, own) in groups.iter().enumerate() {
            if number <= before + own.channels.len() {
                return number.checked_sub(before + 1).map(|channel| (group, channel));
            }
            before += own.channels.len();
        }
        return None;
    }
    let name = name?;
    let place = |same: &dyn Fn(&str) -> bool| {
        groups.iter().enumerate().find_map(|(group, own)| {
            own.channels.iter().position(|channel| same(&channel.name)).map(|channel| (group, channel))
        })
    };
    let matched = groups.iter().enumerate().find_map(|(group, own)| own.channel(name).map(|channel| (group, channel)));
    matched.or_else(|| place(&|other| other.trim().eq_ignore_ascii_case(name.trim())))
}

/// A table `[[log.NAME.channel]]`, for a file.
pub(super) struct Channel<'a, 'd> {
    pub log: Described<'a, 'd>,
    pub table: &'a Table,
    /// For the messages.
    pub what: &'a str,
}

impl Channel<'_, '_> {
    /// The selected channel of the file, with its measured quantity.
    pub fn wire(&self, model: &Model, out: &mut Vec<Diagnostic>) -> Option<MappedChannel> {
        let signal = read_word(self.table, "signal")?;
        let Some((quantity, _)) = quantity_of(signal, model) else {
            let all = signals(model);
            let help = unknown_name(signal, all.iter().map(String::as_str));
            let what = self.what;
            let message =
                format!("{what}: `{}` is not a measured angle, speed or torque of an input", shortened(signal));
            out.push(key_error("name::unknown", message, (self.table, "signal", "no such signal"), help));
            return None;
        };
        let (group, channel) = self.column(out)?;
        let scale = self.of_quantity("scale", &quantity, out);
        let noise = self.of_quantity("noise", &quantity, out);
        let by_unit = match scale {
            Some(scale) => scale,
            None => self.unit_factor(&self.log.groups[group].channels[channel].unit, &quantity, out)?,
        };
        let factor = number(self.table, "factor", self.log.reader, out).unwrap_or(1.0) * by_unit;
        let zero_samples = number(self.table, "zero_samples", self.log.reader, out).unwrap_or(0.0) as usize;
        Some(MappedChannel { group, channel, quantity, factor, zero_samples, noise })
    }

    /// Group and channel that `column` or `number` selects.
    fn column(&self, out: &mut Vec<Diagnostic>) -> Option<(usize, usize)> {
        let Self { log: Described { file, groups, reader, .. }, table, what } = *self;
        let name = read_word(table, "column");
        let number = number(table, "number", reader, out).map(|x| x as usize);
        if name.is_none() && number.is_none() {
            let message = format!("{what} has neither `column` nor `number`");
            let help = "add `column = \"...\"` with its name in the file, or `number = 2`";
            out.push(Diagnostic::error("key::missing", message).at(&table.place, "which column?").help(help));
            return None;
        }
        let place = find(groups, name, number);
        if place.is_none() {
            let all = channel_names(groups);
            let near = name.and_then(|name| nearest(name, all.iter().copied()));
            let columns = || format!("the file has {} columns: {}", all.len(), quoted(all.iter().copied().take(24)));
            let help = did_you_mean(near, columns);
            let column_text =
                name.map_or_else(|| format!("number {}", number.unwrap_or(0)), |name| format!("`{name}`"));
            let key = if name.is_some() { "column" } else { "number" };
            let message = format!("{what}: `{file}` has no column {column_text}");
            out.push(key_error("log::no-column", message, (table, key, "not in the file"), help));
        }
        place
    }

    /// A value in the unit of the measured quantity, SI.
    fn of_quantity(&self, key: &str, quantity: &Quantity, out: &mut Vec<Diagnostic>) -> Option<f64> {
        let scalar = self.table.scalar_or_default(key, &self.table.place)?;
        let label = format!("`{key}` of {}", self.what);
        let (value, dimension) = self.log.reader.scalar(&scalar, None, &label, out)?;
        let expected = quantity.dimension();
        if dimension != expected {
            out.push(Diagnostic::wrong_dimension(&label, [expected, dimension], self.table.place_of(key)));
            return None;
        }
        Some(value.to_f64())
    }

    /// Factor from a reading to SI by its unit: that of the table, or that of the file.
    fn unit_factor(&self, in_file: &str, quantity: &Quantity, out: &mut Vec<Diagnostic>) -> Option<f64> {
        let unit = read_word(self.table, "unit");
        unit_factor(unit.unwrap_or(in_file), quantity)
            .map_err(|why| {
                let key = if unit.is_some() { "unit" } else { "signal" };
                let message = format!("{}: {why}", self.what);
                let help = "add `unit = \"...\"`, or the value of one unit of a reading with `scale = \"200 N m\"`";
                out.push(key_error("unit::dimension", message, (self.table, key, "this unit"), help));
            })
            .ok()
    }
}
