//! Symbols of drivetrain and circuit drawings, around the point (0, 0).

use kardan_results::{MechanismPart, Symbol};

/// A symbol: its drawing, and its extent to the left and right, up and down.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drawn {
    pub(super) svg: String,
    pub(super) half: f64,
    pub(super) up: f64,
    pub(super) down: f64,
}

impl Drawn {
    fn new(svg: impl Into<String>, half: f64, height: f64) -> Self {
        Self { svg: svg.into(), half, up: height, down: height }
    }
}

fn path(class: &str, lines: &str) -> String {
    format!("<path class=\"{class}\" d=\"{lines}\"/>")
}

fn thin(lines: &str) -> String {
    path("thin", lines)
}

fn heavy(lines: &str) -> String {
    path("heavy", lines)
}

fn letter(text: &str) -> String {
    format!("<text class=\"sign\" y=\"4.5\">{text}</text>")
}

/// A wall with hatching on its right, from −9 to 9.
fn wall(x: f64) -> String {
    let strokes: String = [-9.0, -3.0, 3.0].iter().map(|y| format!("M{x} {:.0}l5 -5", y + 6.0)).collect();
    thin(&format!("M{x} -9V9")) + &path("hatch", &strokes)
}

/// The inertia of a shaft as a disc seen from its side.
pub(super) fn disc() -> Drawn {
    Drawn::new("<rect class=\"solid\" x=\"-5\" y=\"-18\" width=\"10\" height=\"36\" rx=\"1\"/>", 5.0, 18.0)
}

/// A translating mass.
pub(super) fn slab() -> Drawn {
    Drawn::new("<rect class=\"solid\" x=\"-13\" y=\"-10\" width=\"26\" height=\"20\" rx=\"1\"/>", 13.0, 10.0)
}

/// A shaft or node without inertia.
pub(super) fn dot() -> Drawn {
    Drawn::new("<circle class=\"solid\" r=\"3.2\"/>", 4.0, 4.0)
}

/// A bearing with losses, fixed to the housing.
pub(super) fn bearing() -> Drawn {
    let lines = thin("M-8 -5H8M-8 5H8");
    let hatch = path("hatch", "M-7 -5l4 -5M-1 -5l4 -5M5 -5l4 -5M-9 10l4 -5M-3 10l4 -5M3 10l4 -5");
    Drawn::new(lines + &hatch, 9.0, 10.0)
}

/// A motor.
pub(super) fn motor() -> Drawn {
    Drawn::new(format!("<circle class=\"motor\" r=\"13\"/>{}", letter("M")), 13.0, 13.0)
}

/// The ground of a circuit below the point.
pub(super) fn earth() -> Drawn {
    Drawn { svg: thin("M-9 0H9M-6 4H6M-3 8H3"), half: 9.0, up: 0.0, down: 9.0 }
}

/// A car from its side, its line comes from the left.
const CAR: &str = "M-17 0H-13M-13 3V-2L-7 -3L-4 -9H6L10 -3L16 -2V3H13M7 3H-4M-10 3H-13M-10 3a3 3 0 1 0 6 0a3 3 0 1 0 -6 0M7 3a3 3 0 1 0 6 0a3 3 0 1 0 -6 0";

/// A small symbol attached to a shaft; its line comes from the left.
pub(super) fn hung(part: &MechanismPart) -> Drawn {
    match part.symbol {
        Symbol::Motor => {
            let motor = "<circle class=\"motor\" r=\"10\"/><text class=\"sign small\" y=\"3.8\">M</text>";
            Drawn::new(thin("M-14 0H-10") + motor, 14.0, 10.0)
        }
        Symbol::Torque if part.terminals.iter().any(|end| end.key.starts_with("mass")) => {
            let arrow = path("torque", "M-10 0H4") + &path("tip", "M2 -5L11 0L2 5z");
            Drawn::new(thin("M-14 0H-10") + &arrow, 14.0, 8.0)
        }
        Symbol::Torque => {
            let arrow = path("torque", "M-5 8.5A9.5 9.5 0 1 1 6.5 7") + &path("tip", "M2.5 11.5l8 -1.5l-4.5 -6.5z");
            Drawn::new(thin("M-14 0H0") + &arrow, 14.0, 11.0)
        }
        Symbol::Sensor => Drawn::new(path("sensor", "M-7 9V-9H10L6 -3.5L10 2H-7") + &thin("M-14 0H-7"), 14.0, 10.0),
        Symbol::Clutch => Drawn::new(thin("M-14 0H-3M-3 -8V8M2 -8V8M2 0H8") + &wall(8.0), 14.0, 10.0),
        Symbol::Stop => Drawn::new(thin("M-14 0H-2M-2 -4V4M4 -8V8M4 0H8") + &wall(8.0), 14.0, 10.0),
        Symbol::Relation => Drawn::new(thin("M-14 0H3") + &wall(3.0), 14.0, 10.0),
        Symbol::Vehicle => Drawn::new(thin(CAR), 17.0, 10.0),
        _ => {
            let has = |law: &str| part.laws.iter().any(|own| own == law);
            let body = if has("stiffness") {
                "M-14 0H-12l2 -5l4 10l4 -10l4 10l2 -5H8"
            } else if has("damping") {
                "M-14 0H-6M-6 -4V4M-9 -6H2V6H-9M2 0H8"
            } else {
                "M-14 0H-4M-4 -6V6M0 -6V6M0 0H8"
            };
            Drawn::new(thin(body) + &wall(8.0), 14.0, 10.0)
        }
    }
}

/// Spring, dashpot and friction in parallel, as many as there are.
fn parallel(part: &MechanismPart) -> Drawn {
    let rows: Vec<&str> = [
        ("stiffness", "l4 -7l8 14l8 -14l8 14l8 -14l8 14l4 -7"),
        ("damping", "h18m0 -6v12m-7 -15h14v18h-14m14 -9h23"),
        ("friction", "h21m0 -7v14m6 -14v14m0 -7h21"),
    ]
    .into_iter()
    .filter(|(law, _)| part.laws.iter().any(|own| own == law))
    .map(|(_, path)| path)
    .collect();
    let count = rows.len() as f64;
    let place = |k: usize| 20.0 * (k as f64 - 0.5 * (count - 1.0));
    let mut lines = String::new();
    if rows.is_empty() {
        lines += "M-24 0H24";
    }
    if rows.len() > 1 {
        let (first, last) = (place(0), place(rows.len() - 1));
        lines += &format!("M-24 {first}V{last}M24 {first}V{last}");
    }
    for (k, row) in rows.iter().enumerate() {
        lines += &format!("M-24 {}{row}", place(k));
    }
    Drawn::new(heavy("M-36 0H-24M24 0H36") + &thin(&lines), 36.0, 10.0 * (count - 1.0).max(0.0) + 10.0)
}

/// An element with one end to the left and one to the right; backlash is two flanks across the end to the right.
pub(super) fn between(part: &MechanismPart) -> Drawn {
    let mut drawn = draw_rigid_element(part);
    if part.laws.iter().any(|law| law == "backlash") {
        let end = drawn.half;
        drawn.svg += &thin(&format!("M{} -6V6M{} -6V6", end - 9.0, end - 4.0));
    }
    drawn
}

fn source(signs: &str) -> Drawn {
    Drawn::new(format!("<circle class=\"motor\" r=\"14\"/>{signs}"), 34.0, 15.0)
}

fn draw_rigid_element(part: &MechanismPart) -> Drawn {
    match part.symbol {
        Symbol::SpringDamper => parallel(part),
        Symbol::UniversalJoint => {
            let ends = heavy("M-26 0H-14M14 0H26");
            let forks = thin("M-2 -12A12 12 0 0 0 -2 12M2 -12A12 12 0 0 1 2 12");
            let cross = heavy("M-7 -7L7 7M-7 7L7 -7") + "<circle class=\"solid\" r=\"3\"/>";
            Drawn::new(ends + &forks + &cross, 26.0, 14.0)
        }
        Symbol::Motor => Drawn::new(heavy("M-26 0H-13M13 0H26") + &motor().svg, 26.0, 14.0),
        Symbol::Clutch => Drawn::new(heavy("M-30 0H-4M4 0H30M-4 -12V12M4 -12V12"), 30.0, 13.0),
        Symbol::Stop => {
            let stops = thin("M-4 -6V6M10 -12V12M10 -12H-12V-6M10 12H-12V6");
            Drawn::new(heavy("M-30 0H-4M10 0H30") + &stops, 30.0, 13.0)
        }
        Symbol::Resistor => Drawn::new(
            thin("M-34 0H-18M18 0H34") + "<rect class=\"box\" x=\"-18\" y=\"-7\" width=\"36\" height=\"14\"/>",
            34.0,
            9.0,
        ),
        Symbol::Inductor => {
            Drawn::new(thin("M-34 0H-20a5 6 0 0 1 10 0a5 6 0 0 1 10 0a5 6 0 0 1 10 0a5 6 0 0 1 10 0H34"), 34.0, 9.0)
        }
        Symbol::Capacitor => Drawn::new(thin("M-34 0H-4M4 0H34") + &heavy("M-4 -11V11M4 -11V11"), 34.0, 12.0),
        Symbol::CurrentSource => source(&(thin("M-34 0H-14M14 0H34M-9 0H5") + &path("tip", "M3 -4.5L10 0L3 4.5z"))),
        Symbol::Source => source(&thin("M-34 0H-14M14 0H34M-9 -3V3M5 0H11M8 -3V3")),
        _ => Drawn::new(
            thin("M-30 0H-17M17 0H30")
                + "<rect class=\"box\" x=\"-17\" y=\"-14\" width=\"34\" height=\"28\" rx=\"3\"/>"
                + &icon(part.symbol).unwrap_or_default(),
            30.0,
            16.0,
        ),
    }
}

/// The symbol in the middle of a box with several ends.
pub(super) fn icon(symbol: Symbol) -> Option<String> {
    match symbol {
        Symbol::StrainWaveGear => Some(
            "<circle class=\"thin\" r=\"14\"/><ellipse class=\"thin\" rx=\"11.5\" ry=\"8\"/><circle class=\"solid\" r=\"2.5\"/>".into(),
        ),
        Symbol::PlanetaryGear => Some(
            "<circle class=\"thin\" r=\"14\"/><circle class=\"thin\" r=\"5\"/><circle class=\"thin\" cx=\"0\" cy=\"-9.5\" r=\"4\"/>\
             <circle class=\"thin\" cx=\"8.2\" cy=\"4.75\" r=\"4\"/><circle class=\"thin\" cx=\"-8.2\" cy=\"4.75\" r=\"4\"/>"
                .into(),
        ),
        Symbol::Transformer => Some(thin(
            "M-7 -16a4 4 0 0 1 0 8a4 4 0 0 1 0 8a4 4 0 0 1 0 8a4 4 0 0 1 0 8M7 -16a4 4 0 0 0 0 8a4 4 0 0 0 0 8a4 4 0 0 0 0 8a4 4 0 0 0 0 8M0 -16V16",
        )),
        Symbol::Machine => Some(format!("<circle class=\"motor\" r=\"13\"/>{}", letter("M"))),
        Symbol::Relation => Some(letter("Σ")),
        _ => None,
    }
}
