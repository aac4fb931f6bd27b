//! The drawing of the mechanism of every built-in model, read from its page.

use std::collections::BTreeMap;

use kardan::element::find;
use kardan::model::{BUILTIN, read};
use kardan::results::{Analysis, Mechanism};
use kardan::schema::Kind;
use kardan::units::Dimension;

/// Width of a character of a label of 12 px, px.
const CHARACTER: f64 = 7.0;
/// Height of a label, px.
const HEIGHT: f64 = 12.0;

fn page(mechanism: Mechanism) -> String {
    kardan_report::analysis(&Analysis { mechanism, ..Analysis::default() }).html()
}

fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
    let after = tag.split_once(&format!("{name}=\"")).expect("the attribute is there").1;
    after.split_once('"').expect("it ends").0
}

/// Left, top, right, bottom and text of each label.
fn labels(drawing: &str) -> Vec<([f64; 4], String)> {
    let label = |text: &str| {
        let (tag, tail) = text.split_once('>').expect("the tag ends");
        let content = tail.split_once('<').expect("the text ends").0;
        let [x, y] = ["x", "y"].map(|name| attribute(tag, &format!(" {name}")).parse::<f64>().expect("a number"));
        let wide = CHARACTER * content.chars().count() as f64;
        let left = if tag.contains(" middle") { x - 0.5 * wide } else { x };
        ([left, y - 0.8 * HEIGHT, left + wide, y + 0.2 * HEIGHT], content.to_owned())
    };
    drawing.split("<text class=\"label").skip(1).map(label).collect()
}

#[test]
fn every_built_in_model_is_drawn_with_each_part_once() {
    for model in BUILTIN {
        let mechanism = read(model.source).0.model(&[]).0.mechanism;
        assert!(!mechanism.parts.is_empty(), "{}", model.name);
        let page = page(mechanism.clone());
        let drawing = page.split_once("<section id=\"mechanism\">").expect("a section").1;
        let drawing = drawing.split_once("</section>").expect("its end").0;
        let mut count: BTreeMap<(&str, &str), usize> = BTreeMap::new();
        for part in drawing.split("<g class=\"part\"").skip(1) {
            *count.entry((attribute(part, "data-kind"), attribute(part, "data-name"))).or_default() += 1;
        }
        for part in &mechanism.parts {
            let times = count.remove(&(part.kind.as_str(), part.name.as_str()));
            assert_eq!(times, Some(1), "{}: {} {}", model.name, part.kind, part.name);
        }
        assert!(count.iter().all(|((kind, _), times)| *kind == "node" && *times == 1), "{}: {count:?}", model.name);
        let labels = labels(drawing);
        assert!(labels.len() >= mechanism.parts.len(), "{}: {labels:?}", model.name);
        for (k, (a, one)) in labels.iter().enumerate() {
            assert!(!one.contains('…'), "{}: {one} is shortened", model.name);
            for (b, other) in &labels[k + 1..] {
                let apart = a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
                assert!(apart, "{}: `{one}` lies on `{other}`", model.name);
            }
        }
    }
}

/// A page within a page does not draw the mechanism again, and a model without parts has no such section.
#[test]
fn the_mechanism_is_drawn_once_at_the_head() {
    let mechanism = read(BUILTIN[0].source).0.model(&[]).0.mechanism;
    let analysis = Analysis { mechanism: mechanism.clone(), ..crate::examples::two_bodies() };
    let mut study = kardan::results::Study { analysis: Some(analysis), ..Default::default() };
    study.model.mechanism = mechanism;
    let page = kardan_report::study(&study);
    assert_eq!(page.sections[0].anchor, "mechanism");
    assert_eq!(page.html().matches("class=\"drawing mechanism\"").count(), 1);
    assert!(!page.text("").contains("Mechanism") && !page.markdown().contains("data-kind"));
    assert!(!self::page(Mechanism::default()).contains("id=\"mechanism\""));
}

/// What appears under the pointer has the unit that its key declares, a number without one where the key has none.
#[test]
fn values_in_the_drawing_have_their_units() {
    let mut checked = 0;
    for model in BUILTIN {
        let mechanism = read(model.source).0.model(&[]).0.mechanism;
        let page = page(mechanism.clone());
        let titles = page.split("<title>").filter_map(|text| Some(text.split_once("</title>")?.0));
        let read = |text: &str| text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
        let titles: Vec<String> = titles.map(read).collect();
        for part in mechanism.parts.iter().filter(|part| !part.values.is_empty()) {
            let kind = find(&part.kind).expect("a kind of the registry");
            let title = format!("{} {}: {}", part.kind.replace('_', " "), part.name, part.values);
            assert!(titles.contains(&title), "{}: {title}", model.name);
            for (key, value) in part.values.split(", ").filter_map(|one| one.split_once(" = ")) {
                let field = kind.fields.iter().find(|field| field.name.replace('_', " ") == key).expect("a key");
                let unit = match field.kind {
                    Kind::Quantity(dimension, _) if dimension == Dimension::ANGLE => "deg".into(),
                    Kind::Quantity(dimension, _) => dimension.si(),
                    Kind::Number(_) => String::new(),
                    _ => continue,
                };
                let (number, found) = value.split_once(' ').unwrap_or((value, ""));
                assert!(number.parse::<f64>().is_ok() && found == unit, "{}: {key} = {value}", title);
                checked += 1;
            }
        }
    }
    assert!(checked > 100, "{checked}");
}

/// What a relation in an expression ties together are its ends, drawn with lines.
#[test]
fn relations_in_expressions_have_ends() {
    let source = kardan::model::builtin("unicycle").expect("a model").source;
    let mechanism = read(source).0.model(&[]).0.mechanism;
    for (name, own) in [("rolls_x", "x"), ("rolls_y", "y")] {
        let part = mechanism.parts.iter().find(|part| part.name == name).expect("a constraint");
        let mut ends: Vec<&str> = part.terminals.iter().map(|end| end.name.as_str()).collect();
        ends.sort_unstable();
        assert_eq!(ends, ["heading", "roll", own]);
    }
}
