//! Additional terms besides those of the model: `[[identification.extra]]`.

use super::channels::{Harmonic, Quantity};
use crate::study::read::read_values::{key_error, quantity, read_word};
use kardan_identify::{Extra, ExtraFriction, Shape};
use kardan_math::names::did_you_mean;
use kardan_math::units::Dimension;
use kardan_mechanics::assemble::Equations;
use kardan_mechanics::equations::{Domain, Term};
use kardan_model::{Document, Model, TableReader};
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::schema::{Sign, Table};

/// The law of an additional term.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Law {
    /// With the Stribeck speed, if known.
    Stribeck {
        shape: Shape,
        speed: Option<f64>,
    },
    /// With the input that loads the gear.
    Load {
        torque: String,
    },
    FrictionAsymmetry,
    DampingAsymmetry,
    Quadratic,
    Drift,
    /// One column for each recording except the last of those with the same direction of rotation, after the logs are read.
    Recordings,
    Recording {
        recording: usize,
        last: usize,
    },
    Cogging(Harmonic),
    Ripple(Harmonic),
    Offset,
    Backlash {
        clear: f64,
    },
    /// Gear loss of an element, proportional to its load; `back`: while its first body is driven.
    Teeth {
        back: bool,
    },
    /// A parameter of laws of torques.
    Parameter {
        unit: String,
        /// The value of the file.
        before: f64,
        /// Whether such a law depends on an angle.
        over_angle: bool,
    },
}

impl Law {
    /// The name of its kind; empty for a parameter of laws, which no entry declares.
    fn kind(&self) -> &'static str {
        match self {
            Self::Stribeck { .. } => "stribeck",
            Self::Load { .. } => "load",
            Self::FrictionAsymmetry => "friction_asymmetry",
            Self::DampingAsymmetry => "damping_asymmetry",
            Self::Quadratic => "quadratic",
            Self::Drift => "drift",
            Self::Recordings | Self::Recording { .. } => "recordings",
            Self::Cogging(_) => "cogging",
            Self::Ripple(_) => "ripple",
            Self::Offset => "offset",
            Self::Backlash { .. } => "backlash",
            Self::Teeth { .. } => "gear_loss",
            Self::Parameter { .. } => "",
        }
    }
}

/// A kind of `[[identification.extra]]`: its name, the key that names its element, its further keys, and the keys of its
/// parameters, first that of the term; `*` stands for the numbers of several.
type ExtraKind = (&'static str, &'static str, &'static [&'static str], &'static [&'static str]);

const KINDS: [ExtraKind; 12] = [
    ("stribeck", "friction", &["shape", "speed"], &["stribeck", "stribeck_speed"]),
    ("load", "friction", &["torque"], &["load_loss"]),
    ("friction_asymmetry", "friction", &[], &["friction_asymmetry"]),
    ("damping_asymmetry", "friction", &[], &["damping_asymmetry"]),
    ("quadratic", "friction", &[], &["quadratic_damping"]),
    ("drift", "friction", &[], &["friction_drift"]),
    ("recordings", "friction", &[], &["friction_recordings*"]),
    ("cogging", "friction", &["order"], &["cogging*"]),
    ("ripple", "friction", &["order"], &["friction_ripple*"]),
    ("offset", "torque", &[], &["offset"]),
    ("backlash", "spring", &["min_deflection"], &["backlash_torque", "backlash"]),
    ("gear_loss", "gear", &[], &["tooth_loss", "tooth_loss_back", "efficiency", "efficiency_back"]),
];

fn kind_named(name: &str) -> Option<ExtraKind> {
    KINDS.into_iter().find(|kind| kind.0 == name)
}

/// The kind that has a parameter of such a key, and the key that names its element.
pub(super) fn kind_of_parameter(key: &str) -> Option<(&'static str, &'static str)> {
    let is = |own: &&str| own.strip_suffix('*').map_or(*own == key, |start| key.starts_with(start));
    KINDS.iter().find(|(.., parameters)| parameters.iter().any(is)).map(|(name, element, ..)| (*name, *element))
}

/// An additional term, or one column of it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ExtraTerm {
    /// Of the column: `fs.stribeck`, `wg.load_loss`, `wg.cogging_6_cos`.
    pub name: String,
    /// Of the term: `wg.cogging_6`; the same as the name where it has one column.
    pub term: String,
    /// The element along whose direction it acts: an element with friction, a motor, a spring.
    pub element: String,
    pub law: Law,
    /// Remark about the column beside its value.
    pub remark: String,
}

impl ExtraTerm {
    /// A term of one column that an entry of the file can declare.
    pub fn new(element: &str, law: Law) -> Self {
        let (.., parameters) = kind_named(law.kind()).expect("a declared term has a kind");
        let term = format!("{element}.{}", parameters[0].trim_end_matches('*'));
        Self { name: term.clone(), term, element: element.into(), law, remark: String::new() }
    }

    /// The two columns of a harmonic.
    pub fn harmonics(element: &str, order: f64, ripple: bool) -> [Self; 2] {
        [false, true].map(|sine| {
            let harmonic = Harmonic { shaft: element.into(), order, sine };
            let own = Self::new(element, if ripple { Law::Ripple(harmonic) } else { Law::Cogging(harmonic) });
            let term = format!("{}_{order}", own.term);
            Self { name: format!("{term}_{}", if sine { "sin" } else { "cos" }), term, ..own }
        })
    }

    /// The two columns of a gear loss.
    pub fn teeth(element: &str) -> [Self; 2] {
        [false, true].map(|back| {
            let own = Self::new(element, Law::Teeth { back });
            Self { name: if back { format!("{}_back", own.name) } else { own.name.clone() }, ..own }
        })
    }

    /// The shape over the speed, if it has one, and then the speed, if it is known.
    pub fn shape(&self) -> Option<(Shape, Option<f64>)> {
        if let Law::Stribeck { shape, speed } = self.law { Some((shape, speed)) } else { None }
    }

    /// The name of its Stribeck speed.
    pub fn speed_name(&self) -> String {
        format!("{}.stribeck_speed", self.element)
    }

    /// The name of the efficiency that a gear loss means, while the first body drives or (`back`) is driven.
    pub fn efficiency_name(&self, back: bool) -> String {
        format!("{}.{}", self.element, if back { "efficiency_back" } else { "efficiency" })
    }

    /// The input on whose torque it depends.
    pub fn torque(&self) -> Option<&str> {
        match &self.law {
            Law::Load { torque } => Some(torque),
            Law::Offset => Some(&self.element),
            _ => None,
        }
    }

    /// The harmonic on which it depends.
    pub fn harmonic(&self) -> Option<&Harmonic> {
        if let Law::Cogging(harmonic) | Law::Ripple(harmonic) = &self.law { Some(harmonic) } else { None }
    }

    /// Its unit along coordinates of a domain.
    pub fn unit(&self, domain: Domain) -> &str {
        match (&self.law, domain) {
            (Law::Parameter { unit, .. }, _) => unit,
            (Law::Load { .. } | Law::Teeth { .. }, _) => "1",
            (Law::DampingAsymmetry, _) => domain.units()[1],
            (Law::Quadratic, Domain::Rotation) => "N m s^2/rad^2",
            (Law::Quadratic, Domain::Translation) => "N s^2/m^2",
            (Law::Quadratic, Domain::Charge) => "V/A^2",
            (Law::Drift, Domain::Rotation) => "N m/s",
            (Law::Drift, Domain::Translation) => "N/s",
            (Law::Drift, Domain::Charge) => "V/s",
            _ => domain.effort().unit(),
        }
    }

    /// Whether a name is that of the term, of its column, or of its Stribeck speed.
    pub fn is(&self, name: &str) -> bool {
        name == self.name || name == self.term || (self.shape().is_some() && name == self.speed_name())
    }

    /// How a model file declares it, along coordinates of a domain.
    pub fn file_entry(&self, domain: Domain) -> String {
        let Some((kind, key, ..)) = kind_named(self.law.kind()) else { return String::new() };
        let more = match &self.law {
            Law::Load { torque } => format!("torque = \"{torque}\"\n"),
            Law::Cogging(harmonic) | Law::Ripple(harmonic) => format!("order = {}\n", harmonic.order),
            Law::Backlash { clear } => format!("min_deflection = \"{clear} {}\"\n", domain.motion()[0].unit()),
            _ => String::new(),
        };
        format!("[[identification.extra]]\nkind = \"{kind}\"\n{key} = \"{}\"\n{more}", self.element)
    }
}

/// The names of terms that are parameters of laws, in order.
pub(super) fn law_parameters(extras: &[ExtraTerm]) -> Vec<String> {
    let own = extras.iter().filter(|extra| matches!(extra.law, Law::Parameter { .. }));
    own.map(|extra| extra.name.clone()).collect()
}

/// The terms that the file declares, column by column.
pub(super) fn declared_terms(document: &Document, model: &Model, out: &mut Vec<Diagnostic>) -> Vec<ExtraTerm> {
    let mut terms: Vec<ExtraTerm> = Vec::new();
    for (k, table) in document.identification.tables("extra").iter().enumerate() {
        let what = format!("entry {} of `[[identification.extra]]`", k + 1);
        let columns = Declared { document, model, table, what: &what }.columns(out);
        let Some(first) = columns.first() else { continue };
        if terms.iter().any(|candidate| candidate.term == first.term) {
            let message = format!("{what}: there are two terms `{}`", first.term);
            let help = "remove one of them";
            out.push(Diagnostic::error("name::duplicate", message).at(&table.place, "again here").help(help));
            continue;
        }
        terms.extend(columns);
    }
    terms
}

/// One entry of the list.
struct Declared<'a> {
    document: &'a Document,
    model: &'a Model,
    table: &'a Table,
    what: &'a str,
}

/// Help for a key that a kind needs.
const NEEDS: [(&str, &str, &str); 7] = [
    ("load", "torque", "name the motor or disturbance whose torque goes through the gear"),
    ("offset", "torque", "name the motor or disturbance whose torque was measured"),
    ("cogging", "order", "write the number of periods per revolution: `order = 6`"),
    ("ripple", "order", "write the number of periods per revolution: `order = 1`"),
    ("gear_loss", "gear", "name the gear, harmonic_drive, rack_and_pinion or screw with the gear loss"),
    ("backlash", "spring", "name the spring_damper that has it"),
    ("backlash", "min_deflection", "write a twist that certainly exceeds the backlash: `min_deflection = \"1 mrad\"`"),
];

impl Declared<'_> {
    /// Its columns, if it has no error.
    fn columns(&self, out: &mut Vec<Diagnostic>) -> Vec<ExtraTerm> {
        let kind = read_word(self.table, "kind").and_then(kind_named);
        let Some((kind, direction, keys, _)) = kind else { return Vec::new() };
        let before = out.len();
        let needed = NEEDS.iter().filter(|(of, ..)| *of == kind).map(|(_, key, help)| (*key, *help));
        let friction = (direction == "friction").then_some(("friction", "name the element whose friction it adds to"));
        for (key, help) in needed.chain(friction) {
            if !self.table.values.contains_key(key) {
                out.push(
                    Diagnostic::error("key::missing", format!("{}: the kind `{kind}` needs `{key}`", self.what))
                        .at(&self.table.place, format!("`{key}` is missing"))
                        .help(help),
                );
            }
        }
        self.refuse_idle_keys(kind, (direction, keys), out);
        let element = self.element(direction, out);
        let torque = self.element("torque", out);
        let own = |law: Law| vec![ExtraTerm::new(&element, law)];
        let own_element = self.document.elements.get(&element);
        let translational = own_element.is_some_and(|one| one.kind.keyword == "mass" || one.table.translational);
        let domain = if translational { Domain::Translation } else { Domain::Rotation };
        let reader = TableReader::new(self.document, &[]);
        let mut number = |key: &str, dimension: Dimension| {
            quantity(&reader, self.table, key, (dimension, Sign::Positive), self.what, out).map(|x| x.to_f64())
        };
        let columns = match kind {
            "load" => own(Law::Load { torque }),
            "friction_asymmetry" => own(Law::FrictionAsymmetry),
            "damping_asymmetry" => own(Law::DampingAsymmetry),
            "quadratic" => own(Law::Quadratic),
            "drift" => own(Law::Drift),
            "recordings" => own(Law::Recordings),
            "offset" => own(Law::Offset),
            "gear_loss" => ExtraTerm::teeth(&element).to_vec(),
            "cogging" | "ripple" => {
                let order = number("order", Dimension::NONE).unwrap_or(1.0);
                ExtraTerm::harmonics(&element, order, kind == "ripple").to_vec()
            }
            "backlash" => {
                let clear = number("min_deflection", domain.dimensions()[0]).unwrap_or(0.0);
                own(Law::Backlash { clear })
            }
            _ => {
                let shape = match read_word(self.table, "shape") {
                    Some("exponential") => Shape::Exponential,
                    Some("peak") => Shape::Peak,
                    _ => Shape::Gaussian,
                };
                own(Law::Stribeck { shape, speed: number("speed", domain.dimensions()[1]) })
            }
        };
        if out.len() == before { columns } else { Vec::new() }
    }

    /// Keys without effect.
    fn refuse_idle_keys(&self, kind: &str, (direction, keys): (&str, &[&str]), out: &mut Vec<Diagnostic>) {
        for key in ["shape", "speed", "torque", "order", "spring", "min_deflection", "friction", "gear"] {
            if self.table.values.contains_key(key) && key != direction && !keys.contains(&key) {
                let message = format!("{}: the kind `{kind}` has no `{key}`", self.what);
                let help = "leave it out, or write another kind";
                out.push(key_error("key::unused", message, (self.table, key, "has no effect here"), help));
            }
        }
    }

    /// The element that a key names; empty if there is none.
    fn element(&self, key: &str, out: &mut Vec<Diagnostic>) -> String {
        let Some(name) = read_word(self.table, key) else { return String::new() };
        let is_input = |name: &str| {
            let input = |term: &Term| matches!(term, Term::Input { .. });
            self.model.terms.iter().any(|named| named.element == name && input(&named.term))
        };
        let fits = |keyword: &str| match key {
            "spring" => keyword == "spring_damper",
            "gear" => matches!(keyword, "gear" | "harmonic_drive" | "rack_and_pinion" | "screw"),
            _ => matches!(keyword, "shaft" | "mass" | "spring_damper"),
        };
        let all = self.document.elements.iter();
        let names: Vec<&str> = match key {
            "torque" => all.map(|e| e.name.as_str()).filter(|name| is_input(name)).collect(),
            _ => all.filter(|e| fits(e.kind.keyword)).map(|e| e.name.as_str()).collect(),
        };
        if !names.contains(&name) {
            let (what, label) = match key {
                "torque" => ("motor or disturbance", "no such input"),
                "spring" => ("spring_damper", "no such spring"),
                "gear" => ("gear, harmonic_drive, rack_and_pinion or screw", "no such gear"),
                _ => ("shaft, mass or spring_damper", "no such element"),
            };
            let help = did_you_mean(nearest(name, names.iter().copied()), || "name one of the model".into());
            let message = format!("{}: there is no {what} `{}`", self.what, shortened(name));
            out.push(key_error("name::unknown", message, (self.table, key, label), help));
        }
        name.to_string()
    }
}

/// The harmonics on which terms depend, each once, besides the measured quantities.
pub(super) fn with_harmonics(slots: Vec<Quantity>, extras: &[ExtraTerm]) -> Result<Vec<Quantity>, Vec<Diagnostic>> {
    let mut out = slots;
    for extra in extras {
        let Some(harmonic) = extra.harmonic() else { continue };
        if !out.iter().any(|slot| slot.is_angle_of(&harmonic.shaft)) {
            let angles = out.iter().filter(|slot| matches!(slot, Quantity::Angle(..))).map(Quantity::signal);
            let angles: Vec<String> = angles.collect();
            let message =
                format!("`{}` depends on the angle of `{}`, which is not in the logs", extra.term, extra.element);
            let help = match angles.as_slice() {
                [] => "log it: no angle is in the logs".to_string(),
                all => format!("log it; the angles in the logs are {}", quoted(all.iter().map(String::as_str))),
            };
            return Err(vec![Diagnostic::error("identify::angle", message).help(help)]);
        }
        let slot = Quantity::Harmonic(harmonic.clone());
        if !out.contains(&slot) {
            out.push(slot);
        }
    }
    Ok(out)
}

/// Terms with a column for each recording instead of one placeholder, and notes about omitted terms. `senses`
/// returns whether an element rotated forwards and backwards in each recording.
pub(super) fn with_recordings(
    extras: &[ExtraTerm],
    logs: &[String],
    senses: &dyn Fn(&str) -> Vec<[bool; 2]>,
) -> (Vec<ExtraTerm>, Vec<String>) {
    let (mut out, mut notes) = (Vec::new(), Vec::new());
    for extra in extras {
        if extra.law != Law::Recordings {
            out.push(extra.clone());
            continue;
        }
        let ways = senses(&extra.element);
        let before = out.len();
        for way in [[true, true], [true, false], [false, true]] {
            let same_sense: Vec<usize> = (0..ways.len()).filter(|&k| ways[k] == way).collect();
            let Some((&last, earlier)) = same_sense.split_last() else { continue };
            out.extend(earlier.iter().map(|&recording| ExtraTerm {
                name: format!("{}_{}", extra.term, recording + 1),
                law: Law::Recording { recording, last },
                remark: format!("{} from the mean", logs[recording]),
                ..extra.clone()
            }));
        }
        out[before..].sort_by_key(|one| if let Law::Recording { recording, .. } = one.law { recording } else { 0 });
        if out.len() == before {
            notes.push(format!("kardan omits {}: no two logs have the same direction of rotation", extra.term));
        }
    }
    (out, notes)
}

/// The extra columns of the equations; `harmonics` are those measured, in their order.
pub(super) fn extra_columns(equations: &Equations, extras: &[ExtraTerm], harmonics: &[&Harmonic]) -> Vec<Extra> {
    let column = |extra: &ExtraTerm| {
        let friction = |law: ExtraFriction| {
            let place = equations.frictions.iter().position(|term| term.element == extra.element);
            Extra::Friction { friction: place.expect("every such term has a friction"), law }
        };
        let input = |name: &str| {
            let place = equations.inputs.iter().position(|input| input.element == name);
            place.expect("an input of the model")
        };
        let harmonic = |own: &Harmonic| harmonics.iter().position(|one| *one == own).expect("a harmonic that is read");
        match &extra.law {
            Law::Stribeck { .. } => friction(ExtraFriction::Stribeck),
            Law::Load { torque } => friction(ExtraFriction::Load(input(torque))),
            // Before the recordings are separated it represents its friction only.
            Law::FrictionAsymmetry | Law::Recordings => friction(ExtraFriction::Sense),
            Law::DampingAsymmetry => friction(ExtraFriction::SenseDamping),
            Law::Quadratic => friction(ExtraFriction::Quadratic),
            Law::Drift => friction(ExtraFriction::Drift),
            Law::Recording { recording, last } => {
                friction(ExtraFriction::Recording { recording: *recording, last: *last })
            }
            Law::Cogging(own) => friction(ExtraFriction::Cogging(harmonic(own))),
            Law::Ripple(own) => friction(ExtraFriction::Ripple(harmonic(own))),
            Law::Offset => Extra::Offset { input: input(&extra.element) },
            Law::Teeth { back } => {
                let place = equations.gear_losses().position(|(unilateral, _)| unilateral.element == extra.element);
                Extra::Teeth { teeth: place.expect("every such term has a gear"), back: *back }
            }
            Law::Parameter { .. } => {
                let names = law_parameters(extras);
                let place = names.iter().position(|name| *name == extra.name);
                Extra::Law { parameter: place.expect("it is one of them") }
            }
            Law::Backlash { clear } => {
                let place = equations.springs.iter().position(|term| term.element == extra.element);
                Extra::Backlash { spring: place.expect("every such term has a spring"), clear: *clear }
            }
        }
    };
    extras.iter().map(column).collect()
}
