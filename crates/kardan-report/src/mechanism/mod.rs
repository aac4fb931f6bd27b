//! The mechanism of a model as a picture: shafts, elements, sources, disturbances and sensors.

mod cells;
mod graph;
mod labels;
mod layout;
mod symbols;
#[cfg(test)]
#[path = "../../tests/unit/mechanism.rs"]
mod tests;

use kardan_results::{JoinKind, Mechanism, MechanismPart, Symbol};

use crate::model::Picture;
use crate::text::escape;
use cells::{Group, Mark};
use layout::Scene;

/// Around the drawing, px.
const MARGIN: f64 = 6.0;

/// The drawn parts, and the size of the picture.
fn scene(mechanism: &Mechanism) -> Option<(Scene, [f64; 2])> {
    let scene = layout::scene(&graph::Graph::of(mechanism));
    let size = [scene.width + 2.0 * MARGIN, scene.height + 2.0 * MARGIN];
    (!scene.groups.is_empty()).then_some((scene, size))
}

/// The drawing of a mechanism; none of one without parts.
pub(super) fn picture(mechanism: &Mechanism) -> Option<Picture> {
    let (scene, size) = scene(mechanism)?;
    let picture = Picture::drawn("", size, &describe(mechanism), &svg(&scene), &caption(mechanism, &scene));
    Some(picture.of_class("mechanism"))
}

/// The same as an SVG document of its own, in the colours of the page on paper.
pub(super) fn document(mechanism: &Mechanism) -> Option<String> {
    let (scene, [width, height]) = scene(mechanism)?;
    Some(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"drawing mechanism\" viewBox=\"0 0 {width:.1} {height:.1}\" \
         width=\"{width:.1}\" height=\"{height:.1}\" \
         font-family=\"Helvetica Neue, Helvetica, Arial, Liberation Sans, DejaVu Sans, sans-serif\">\n\
         <title>{}</title>\n<style>\n{}</style>\n<rect x=\"0\" y=\"0\" width=\"100%\" height=\"100%\" class=\"ground\"/>\n{}</svg>\n",
        escape(&describe(mechanism)),
        style(),
        svg(&scene)
    ))
}

/// The rules of the page for drawings, with the colours that it has on white: other programs than browsers know no variables.
fn style() -> String {
    let page = include_str!("../page.css");
    let light = page.split('}').next().unwrap_or_default();
    let named = light.lines().filter_map(|line| line.trim().strip_prefix("--")?.strip_suffix(';')?.split_once(": "));
    let curves = crate::curves::ON_WHITE.iter().enumerate().map(|(k, colour)| (format!("curve-{k}"), *colour));
    let values: Vec<(String, &str)> = named.map(|(name, value)| (name.to_string(), value)).chain(curves).collect();
    let ours = |line: &&str| line.starts_with(".mechanism ") || line.starts_with(".drawing ");
    let mut rules: String = page.lines().filter(ours).flat_map(|line| [line, "\n"]).collect();
    for (name, value) in values {
        rules = rules.replace(&format!("var(--{name})"), value);
    }
    rules + ".mechanism rect.ground { fill: #ffffff; stroke: none; }\n"
}

fn svg(scene: &Scene) -> String {
    let wires: String = scene.wires.iter().map(mark).collect();
    let groups: String = scene.groups.iter().map(group).collect();
    format!("<g transform=\"translate({MARGIN} {MARGIN})\">\n{wires}{groups}</g>\n")
}

fn group(group: &Group) -> String {
    let marks: String = group.marks.iter().map(mark).collect();
    format!(
        "<g class=\"part\" data-kind=\"{}\" data-name=\"{}\"><title>{}</title>\n{marks}</g>\n",
        escape(&group.kind),
        escape(&group.name),
        escape(&group.title)
    )
}

fn mark(mark: &Mark) -> String {
    match mark {
        Mark::Symbol { at: (x, y), drawn, hanging } => {
            let turn = if *hanging { " rotate(90)" } else { "" };
            format!("<g transform=\"translate({x:.1} {y:.1}){turn}\">{}</g>\n", drawn.svg)
        }
        Mark::Line { points, class } => {
            let path: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
            format!("<path class=\"{class}\" d=\"M{}\"/>\n", path.join("L"))
        }
        Mark::Label { at: (x, y), middle, class, text } => {
            let anchor = if *middle { " middle" } else { "" };
            format!("<text class=\"label {class}{anchor}\" x=\"{x:.1}\" y=\"{y:.1}\">{}</text>\n", escape(text))
        }
        Mark::Box { place: [x, y, width, height], class, radius } => {
            format!(
                "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"{radius}\"/>\n"
            )
        }
    }
}

/// `5 shafts, 7 elements`
fn describe(mechanism: &Mechanism) -> String {
    let count = |count: usize, one: &str| if count == 1 { format!("1 {one}") } else { format!("{count} {one}s") };
    let of = |symbol: Symbol| mechanism.parts.iter().filter(|part| part.symbol == symbol).count();
    let bodies = of(Symbol::Shaft) + of(Symbol::Mass);
    let counts = [
        (of(Symbol::Shaft), "shaft"),
        (of(Symbol::Mass), if of(Symbol::Mass) == 1 { "mass" } else { "masse" }),
        (mechanism.parts.len() - bodies, "element"),
    ];
    let both = counts.into_iter().filter(|(number, _)| *number > 0);
    both.map(|(number, one)| count(number, one)).collect::<Vec<_>>().join(", ")
}

/// The meaning of the symbols in the drawing.
fn caption(mechanism: &Mechanism, scene: &Scene) -> String {
    let parts = &mechanism.parts;
    let symbol = |symbol: Symbol| parts.iter().any(|part| part.symbol == symbol);
    let is_grounded = |part: &MechanismPart| match part.symbol {
        Symbol::Relation => part.terminals.len() == 1,
        Symbol::Motor => false,
        _ => part.terminals.iter().any(|end| end.kind == JoinKind::Housing),
    };
    let housing = parts.iter().any(is_grounded);
    let losses = parts.iter().any(|part| part.symbol.is_body() && part.laws.iter().any(|law| law != "inertia"));
    let backlash = parts.iter().any(|part| part.laws.iter().any(|law| law == "backlash"));
    let folded = scene.groups.iter().any(|group| group.kind == "folded");
    let remarks = [
        (symbol(Symbol::StrainWaveGear), "WG: wave generator; CS: circular spline; FS: flexspline"),
        (losses, "hatched: bearings with losses"),
        (symbol(Symbol::Motor) || symbol(Symbol::Machine), "M: motors"),
        (backlash, "two flanks across an end: backlash"),
        (symbol(Symbol::Torque), "arrows: external torques and forces"),
        (symbol(Symbol::Sensor), "flags: sensors (φ angle, ω speed, τ torque; of masses s, v, F)"),
    ];
    let remarks: Vec<&str> = remarks.iter().filter(|(applies, _)| *applies).map(|(_, text)| *text).collect();
    let mut out = format!("{}. ", describe(mechanism));
    if !remarks.is_empty() {
        let text = remarks.join("; ");
        let mut letters = text.chars();
        let first = letters.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
        out += &format!("{first}{}. ", letters.as_str());
    }
    if housing && !losses {
        out += "Hatched lines are the housing. ";
    }
    if folded {
        out += "The model is large: dashed boxes count what is not drawn. ";
    }
    out + "The values of a part appear under the pointer."
}
