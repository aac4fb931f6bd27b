//! Names of coordinates, elements and outputs: what they are, and errors of those that are not there.

use std::collections::{BTreeSet, HashMap};

use crate::document::Instance;
use crate::keys::GUESSES;
use kardan_math::names::{did_you_mean, is_fixed_name};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Domain, GROUND};
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Field, Kind, Placed, Table, Value};

use super::{TableReader, guess};

impl TableReader<'_> {
    /// The keywords of the elements of a name.
    fn kinds(&self, name: &str) -> &[&'static str] {
        let all = self.elements.get_or_init(|| {
            let mut all: HashMap<&str, Vec<&'static str>> = HashMap::new();
            for element in &self.document.elements {
                all.entry(&element.name).or_default().push(element.kind.keyword);
            }
            all
        });
        all.get(name).map_or(&[], Vec::as_slice)
    }

    /// The outputs that a law controls must be shaft angles.
    pub(crate) fn check_outputs(&self, fields: &[Field], table: &Table, what: &str, out: &mut Vec<Diagnostic>) {
        for field in fields {
            match (field.kind, table.values.get(field.name)) {
                (Kind::Signal, Some(Placed { value: Value::Word(signal), place })) => {
                    let label = format!("`{}` of {what}", field.name);
                    let name = SignalName::new(signal);
                    let is_angle =
                        self.motion(signal).is_some_and(|(body, number)| number == 0 && self.body(body).is_some());
                    if is_angle || self.document.suppressed.has(name.element) {
                        continue;
                    }
                    let angles: Vec<String> = self.motions().map(|[angle, _]| angle).collect();
                    let all = || angles.iter().map(String::as_str);
                    let message = format!("{label}: `{}` is not the angle of a shaft", shortened(signal));
                    let own = all().find(|angle| SignalName::new(angle).element == name.element);
                    let near = own.or_else(|| nearest(signal, all()));
                    let help = did_you_mean(near, || format!("a law controls one of {}", quoted(all())));
                    out.push(Diagnostic::error("name::unknown", message).at(place, "not an angle").help(help));
                }
                (Kind::Output, Some(Placed { value: Value::Word(signal), place })) => {
                    self.check_output(signal, place, &format!("`{}` of {what}", field.name), false, out);
                }
                (Kind::Outputs, Some(Placed { value: Value::Names(signals), .. })) => {
                    for Placed { value, place } in signals {
                        self.check_output(value, place, &format!("`{}` of {what}", field.name), true, out);
                    }
                }
                (Kind::Table(inner), Some(Placed { value: Value::Tables(tables), .. })) => {
                    for table in tables {
                        self.check_outputs(inner, table, &format!("`{}` of {what}", field.name), out);
                    }
                }
                (Kind::Tables(inner), Some(Placed { value: Value::Tables(tables), .. })) => {
                    for (i, table) in tables.iter().enumerate() {
                        let what = format!("entry {} of `{}` of {what}", i + 1, field.name);
                        self.check_outputs(inner, table, &what, out);
                    }
                }
                _ => {}
            }
        }
    }

    /// An output must be an angle or a speed of a shaft, or a sensor; a measurement may also be the current of a branch.
    fn check_output(&self, signal: &str, place: &Place, label: &str, measured: bool, out: &mut Vec<Diagnostic>) {
        let name = SignalName::new(signal);
        let (head, quantity, unqualified) = (name.element, name.quantity(), name.on.is_none());
        if let Some((sensor, measured, _)) = self.document.signal_sensor(head) {
            let message = format!(
                "{label}: `{}` measures the signal `{}`, which no equation of the mechanism gives",
                shortened(sensor),
                shortened(measured)
            );
            let help = "name angles and speeds, or sensors of them and of torques; blocks and programs read signals";
            out.push(Diagnostic::error("name::unknown", message).at(place, "not an output").help(help));
            return;
        }
        let sensors = || self.document.elements.iter().filter(|e| e.kind.keyword == "sensor").map(|e| e.name.as_str());
        let is_motion = name.is_position() || name.is_rate();
        let is_reading =
            name.word.is_none() || is_motion || matches!(quantity, Some(Quantity::Torque | Quantity::Force));
        let of_sensor = unqualified && is_reading && self.kinds(head).contains(&"sensor");
        let is_output =
            |(coordinate, number): (&str, usize)| self.body(coordinate).is_some() || measured && number == 1;
        if self.motion(signal).is_some_and(is_output) || of_sensor || self.document.suppressed.has(head) {
            return;
        }
        let currents = self.charges().iter().filter(|_| measured).map(|branch| Quantity::Current.of(branch));
        let all: Vec<String> = self.motions().flatten().chain(currents).chain(sensors().map(str::to_string)).collect();
        let names = || all.iter().map(String::as_str);
        let help = did_you_mean(nearest(signal, names()), || match quantity {
            Some(Quantity::Torque | Quantity::Force) if unqualified => format!(
                "add a sensor of that torque: `[sensor.NAME]` with `measures = \"torque\"` and `element = \"{}\"`",
                shortened(head)
            ),
            _ => format!("there are {}", quoted(names())),
        });
        let current = if measured { ", no current" } else { "" };
        let message =
            format!("{label}: `{}` is not an angle or speed of a shaft{current}, nor a sensor", shortened(signal));
        out.push(Diagnostic::error("name::unknown", message).at(place, "not an output").help(help));
    }

    /// Coordinates with their rates: of shafts, masses and charges.
    pub(crate) fn all_motions(&self) -> impl Iterator<Item = [String; 2]> {
        let of_charge = |charge: String| Domain::Charge.motion().map(|quantity| quantity.of(&charge));
        self.motions().chain(self.document.charges().into_iter().map(of_charge))
    }

    /// The coordinate that a name is the position (0) or the rate (1) of.
    pub(crate) fn motion<'n>(&self, name: &'n str) -> Option<(&'n str, usize)> {
        let (coordinate, word) = name.rsplit_once('.')?;
        let domain = self.body(coordinate).or_else(|| self.charges().get(coordinate).map(|_| Domain::Charge))?;
        Some((coordinate, domain.motion().iter().position(|quantity| quantity.word() == word)?))
    }

    /// The charges that the elements introduce as coordinates.
    fn charges(&self) -> &BTreeSet<String> {
        self.charges.get_or_init(|| self.document.charges().into_iter().collect())
    }

    /// Whether a name is that of the housing, and of no shaft or mass.
    pub(crate) fn is_ground(&self, name: &str) -> bool {
        name == GROUND && self.body(name).is_none()
    }

    /// The dimension of an angle, a speed, a position or a velocity of the housing, which are zero.
    pub(crate) fn motion_of_ground(&self, name: &str) -> Option<Dimension> {
        let domains = [Domain::Rotation, Domain::Translation];
        let mut all = domains.into_iter().flat_map(|domain| domain.motion().into_iter().zip(domain.dimensions()));
        let (_, dimension) = all.find(|(quantity, _)| quantity.of(GROUND) == name)?;
        self.is_ground(GROUND).then_some(dimension)
    }

    /// The domain of a coordinate.
    pub(crate) fn domain_of(&self, coordinate: &str) -> Domain {
        self.body(coordinate).unwrap_or(Domain::Charge)
    }

    /// Angles and speeds of shafts, positions and velocities of masses.
    fn motions(&self) -> impl Iterator<Item = [String; 2]> {
        let bodies = self.document.elements.iter().filter_map(|instance| Some((instance, instance.body()?)));
        bodies.map(|(instance, domain)| domain.motion().map(|quantity| quantity.of(&instance.name)))
    }

    /// The shafts, the masses, or both.
    fn bodies(&self, kind: &Kind) -> impl Iterator<Item = &str> {
        let kind = *kind;
        let fits = move |instance: &&Instance| instance.body().is_some_and(|domain| is_of(&kind, domain));
        let bodies = self.document.elements.iter().filter(fits);
        bodies.map(|instance| instance.name.as_str())
    }

    /// The kind of a body: a shaft or a mass.
    pub(super) fn body(&self, name: &str) -> Option<Domain> {
        self.document.elements.all(name).find_map(Instance::body)
    }

    /// A shaft, a mass, or `ground`, which is fixed.
    pub(super) fn check_body(&self, kind: &Kind, name: &str, place: &Place, label: &str, out: &mut Vec<Diagnostic>) {
        if self.body(name).is_some_and(|domain| is_of(kind, domain))
            || self.document.suppressed.has(name)
            || name == GROUND
        {
            return;
        }
        let what = match kind {
            Kind::Shaft => "shaft",
            Kind::Mass => "mass",
            _ if self.bodies(&Kind::Mass).next().is_some() => "shaft or mass",
            _ => "shaft",
        };
        let (message, help) = match self.body(name) {
            Some(other) => (
                format!("{label}: `{name}` is a {}, not a {what}", other.carrier()),
                "connect rotation and translation by a `rack_and_pinion`, a `screw` or a `pulley`".to_string(),
            ),
            None => {
                let keyword = if *kind == Kind::Mass { "mass" } else { "shaft" };
                let declare = format!("`[{keyword}.{}]`", shortened(name));
                let near = guess(name, self.bodies(kind), out);
                let help = if near.is_none() && is_fixed_name(name) {
                    "the fixed frame is called \"ground\"".to_string()
                } else {
                    did_you_mean(near, || match self.bodies(kind).next() {
                        Some(_) if out.len() < GUESSES => {
                            format!("there are {}; declare another as {declare}", quoted(self.bodies(kind)))
                        }
                        _ => format!("declare it: {declare}"),
                    })
                };
                (format!("{label}: there is no {what} `{}`", shortened(name)), help)
            }
        };
        out.push(Diagnostic::error("name::unknown", message).at(place, format!("no such {what}")).help(help));
    }

    /// A shaft, a mass or a charge.
    pub(crate) fn check_coordinate(&self, name: &str, place: &Place, label: &str, out: &mut Vec<Diagnostic>) {
        let charges = self.charges();
        let is_state = self.body(name) == Some(Domain::Number);
        if is_state || charges.contains(name) {
            return;
        }
        if charges.is_empty() {
            return self.check_body(&Kind::Body, name, place, label, out);
        }
        if self.body(name).is_some() || self.document.suppressed.has(name) {
            return;
        }
        let charges = self.document.charges();
        let fitting = || self.bodies(&Kind::Body).chain(charges.iter().map(String::as_str));
        let help = did_you_mean(guess(name, fitting(), out), || match fitting().next() {
            Some(_) if out.len() < GUESSES => format!("there are {}", quoted(fitting())),
            _ => format!("declare it: `[shaft.{}]`", shortened(name)),
        });
        out.push(Diagnostic::no_such(label, "shaft or charge", name, place).help(help));
    }

    pub(super) fn check_element(
        &self,
        name: &str,
        kinds: &[&str],
        place: &Place,
        label: &str,
        out: &mut Vec<Diagnostic>,
    ) {
        let named = self.kinds(name).first();
        let fits = self.kinds(name).iter().any(|keyword| kinds.contains(keyword));
        if fits || named.is_none() && self.document.suppressed.has(name) {
            return;
        }
        let fitting =
            self.document.elements.iter().filter(|e| kinds.contains(&e.kind.keyword)).map(|e| e.name.as_str());
        let help = did_you_mean(guess(name, fitting.clone(), out), || {
            if out.len() < GUESSES && fitting.clone().next().is_some() {
                return format!("there are {}", quoted(fitting));
            }
            format!("declare one: `[{}.{}]`", kinds.first().unwrap_or(&"motor"), shortened(name))
        });
        let required = match kinds.split_last() {
            Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
            _ => kinds.join(" or "),
        };
        let message = match named {
            Some(keyword) => format!("{label}: `{name}` is a {keyword}, not a {required}"),
            None => format!("{label}: there is no {required} `{}`", shortened(name)),
        };
        out.push(Diagnostic::error("name::unknown", message).at(place, "does not fit").help(help));
    }
}

/// Whether a key may name a body of a domain.
fn is_of(kind: &Kind, domain: Domain) -> bool {
    match kind {
        Kind::Shaft => domain == Domain::Rotation,
        Kind::Mass => domain == Domain::Translation,
        _ => domain != Domain::Number,
    }
}
