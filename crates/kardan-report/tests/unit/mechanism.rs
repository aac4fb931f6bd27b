//! Structure of the drawing: every part once, labels overlap no item, lines avoid all items.

use std::collections::BTreeMap;

use super::cells::Mark;
use super::graph::Graph;
use super::layout::{Scene, scene};
use super::*;

/// Kinds and names of what is drawn, from the SVG.
fn drawn(picture: &str) -> Vec<(String, String)> {
    let attribute = |text: &str, name: &str| {
        let from = text.split_once(&format!("{name}=\"")).expect("an attribute").1;
        from.split_once('"').expect("its end").0.to_owned()
    };
    picture
        .split("<g class=\"part\"")
        .skip(1)
        .map(|part| (attribute(part, "data-kind"), attribute(part, "data-name")))
        .collect()
}

fn overlap(a: [f64; 4], b: [f64; 4]) -> bool {
    const TOUCH: f64 = 0.05;
    a[0] + TOUCH < b[2] && b[0] + TOUCH < a[2] && a[1] + TOUCH < b[3] && b[1] + TOUCH < a[3]
}

/// The horizontal and vertical parts of a line.
fn segments(points: &[(f64, f64)]) -> Vec<[f64; 4]> {
    let segment = |pair: &[(f64, f64)]| {
        let [(a, b), (c, d)] = [pair[0], pair[1]];
        assert!((a - c).abs() < 1e-6 || (b - d).abs() < 1e-6, "a line runs askew: {pair:?}");
        [a.min(c), b.min(d), a.max(c), b.max(d)]
    };
    points.windows(2).map(segment).collect()
}

/// No label on another label, on a symbol or on a line; nothing outside; no symbol on another.
fn check(what: &str, scene: &Scene) {
    let all: Vec<&Mark> = scene.groups.iter().flat_map(|group| &group.marks).chain(&scene.wires).collect();
    for mark in &all {
        let [left, top, right, bottom] = mark.bounds();
        let inside = left >= -0.1 && top >= -0.1 && right <= scene.width + 0.1 && bottom <= scene.height + 0.1;
        assert!(inside, "{what}: outside of {} x {}: {mark:?}", scene.width, scene.height);
    }
    let labels: Vec<(&Mark, [f64; 4])> =
        all.iter().filter(|mark| matches!(mark, Mark::Label { .. })).map(|mark| (*mark, mark.bounds())).collect();
    for (k, (one, bounds)) in labels.iter().enumerate() {
        for (other, beside) in &labels[k + 1..] {
            assert!(!overlap(*bounds, *beside), "{what}: one label on another:\n{one:?}\n{other:?}");
        }
        for mark in &all {
            match mark {
                Mark::Symbol { .. } => assert!(!overlap(*bounds, mark.bounds()), "{what}: {one:?} on {mark:?}"),
                Mark::Line { points, .. } => {
                    for segment in segments(points) {
                        let [a, b, c, d] = segment;
                        let thick = [a - 0.5, b - 0.5, c + 0.5, d + 0.5];
                        assert!(!overlap(*bounds, thick), "{what}: {one:?} on the line {mark:?}");
                    }
                }
                Mark::Label { .. } | Mark::Box { .. } => {}
            }
        }
    }
    let body = |mark: &&&Mark| matches!(mark, Mark::Symbol { .. } | Mark::Box { .. });
    for wire in &scene.wires {
        let Mark::Line { points, .. } = wire else { continue };
        for [a, b, c, d] in segments(points) {
            for mark in all.iter().filter(body) {
                let line = [a + 0.4, b - 0.2, c - 0.4, d + 0.2];
                assert!(!overlap(line, mark.bounds()), "{what}: {wire:?} crosses {mark:?}");
            }
        }
    }
}

/// Every part once, or counted among what is folded; gives how many shafts are drawn.
fn check_parts(what: &str, mechanism: &Mechanism) -> usize {
    let scene = scene(&Graph::of(mechanism));
    check(what, &scene);
    let picture = picture(mechanism).expect("a picture");
    let found = drawn(&picture.drawing);
    let mut count: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    found.iter().for_each(|(kind, name)| *count.entry((kind, name)).or_default() += 1);
    let folded = found.iter().any(|(kind, _)| kind == "folded");
    for part in &mechanism.parts {
        let times = count.get(&(part.kind.as_str(), part.name.as_str())).copied().unwrap_or(0);
        assert!(times == 1 || (folded && times == 0), "{what}: {} {} is drawn {times} times", part.kind, part.name);
    }
    found.iter().filter(|(kind, _)| kind == "shaft").count()
}

/// Numbers from a seed (SplitMix64).
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n as u64) as usize
    }
}

fn end(key: &str, kind: JoinKind, name: &str) -> kardan::results::Terminal {
    kardan::results::Terminal { key: key.into(), kind, name: name.into(), coefficient: None }
}

/// Shafts and nodes joined at random, by every symbol.
fn random(dice: &mut Dice) -> Mechanism {
    const BETWEEN: [(&str, Symbol, usize); 8] = [
        ("gear", Symbol::Gear, 2),
        ("harmonic_drive", Symbol::StrainWaveGear, 3),
        ("planetary", Symbol::PlanetaryGear, 3),
        ("spring_damper", Symbol::SpringDamper, 2),
        ("universal_joint", Symbol::UniversalJoint, 2),
        ("constraint", Symbol::Relation, 4),
        ("motor", Symbol::Motor, 2),
        ("dc_motor", Symbol::Machine, 3),
    ];
    const AT: [(&str, Symbol); 5] = [
        ("motor", Symbol::Motor),
        ("disturbance", Symbol::Torque),
        ("sensor", Symbol::Sensor),
        ("spring_damper", Symbol::SpringDamper),
        ("constraint", Symbol::Relation),
    ];
    const WIRES: [(&str, Symbol); 5] = [
        ("resistor", Symbol::Resistor),
        ("inductor", Symbol::Inductor),
        ("capacitor", Symbol::Capacitor),
        ("voltage_source", Symbol::Source),
        ("current_source", Symbol::CurrentSource),
    ];
    let shafts = 1 + dice.below(24);
    let laws = ["inertia", "stiffness", "damping", "friction", "backlash"];
    let part = |dice: &mut Dice, kind: &str, symbol, name: String, terminals| MechanismPart {
        kind: kind.into(),
        name: name + &"_long".repeat(dice.below(12)),
        symbol,
        laws: laws.iter().filter(|_| dice.below(2) == 0).map(ToString::to_string).collect(),
        ratio: (dice.below(2) == 0).then_some(0.1 * dice.below(50) as f64),
        terminals,
        ..MechanismPart::default()
    };
    let mut parts: Vec<MechanismPart> =
        (0..shafts).map(|k| part(dice, "shaft", Symbol::Shaft, format!("shaft{k}"), Vec::new())).collect();
    let names: Vec<String> = parts.iter().map(|part| part.name.clone()).collect();
    for k in 0..dice.below(2 * shafts) {
        let (kind, symbol, ends) = BETWEEN[dice.below(BETWEEN.len())];
        let first = dice.below(shafts);
        let ends = (0..ends.min(shafts)).map(|k| end("a_b", JoinKind::Shaft, &names[(first + k * (1 + k)) % shafts]));
        let ends = ends.collect();
        parts.push(part(dice, kind, symbol, format!("between{k}"), ends));
    }
    for k in 0..dice.below(2 * shafts) {
        let (kind, symbol) = AT[dice.below(AT.len())];
        let ends = vec![end("shaft", JoinKind::Shaft, &names[dice.below(shafts)])];
        parts.push(part(dice, kind, symbol, format!("at{k}"), ends));
    }
    for k in 0..dice.below(12) {
        let (kind, symbol) = WIRES[dice.below(WIRES.len())];
        let node = |dice: &mut Dice| match dice.below(6) {
            0 => end("to", JoinKind::Ground, "ground"),
            node => end("to", JoinKind::Node, &format!("n{node}")),
        };
        let ends = vec![node(dice), node(dice)];
        if ends[0].name != ends[1].name {
            parts.push(part(dice, kind, symbol, format!("wire{k}"), ends));
        }
    }
    Mechanism { parts }
}

#[test]
fn random_mechanisms_have_each_part_once_and_nothing_on_a_label() {
    for seed in 0..400 {
        let mechanism = random(&mut Dice(seed));
        check_parts(&format!("seed {seed}"), &mechanism);
    }
}

fn shafts(count: usize, joins: &[(usize, usize)]) -> Mechanism {
    let shaft = |k: usize| MechanismPart { kind: "shaft".into(), name: format!("s{k}"), ..MechanismPart::default() };
    let join = |(k, (a, b)): (usize, &(usize, usize))| MechanismPart {
        kind: "spring_damper".into(),
        name: format!("k{k}"),
        symbol: Symbol::SpringDamper,
        laws: vec!["stiffness".into()],
        terminals: [a, b].map(|host| end("shaft", JoinKind::Shaft, &format!("s{host}"))).to_vec(),
        ..MechanismPart::default()
    };
    Mechanism { parts: (0..count).map(shaft).chain(joins.iter().enumerate().map(join)).collect() }
}

/// What is folded is counted: shafts and elements drawn and counted are all there are.
#[test]
fn models_of_200_shafts_are_folded_and_counted() {
    let mut dice = Dice(7);
    let chain: Vec<(usize, usize)> = (1..200).map(|k| (k - 1, k)).collect();
    let star: Vec<(usize, usize)> = (1..200).map(|k| (0, k)).collect();
    let ring: Vec<(usize, usize)> = (0..200).map(|k| (k, (k + 1) % 200)).collect();
    let tree: Vec<(usize, usize)> = (1..200).map(|k| (dice.below(k), k)).collect();
    for (what, joins) in [("chain", chain), ("star", star), ("ring", ring), ("tree", tree), ("apart", Vec::new())] {
        let mechanism = shafts(200, &joins);
        let drawn_shafts = check_parts(what, &mechanism);
        assert!((1..=30).contains(&drawn_shafts), "{what}: {drawn_shafts} shafts");
        let scene = scene(&Graph::of(&mechanism));
        assert!(scene.width < 1300.0 && scene.height < 1500.0, "{what}: {} x {}", scene.width, scene.height);
        let counted = |word: &str| -> usize {
            let labels = scene.groups.iter().filter(|group| group.kind == "folded").flat_map(|group| &group.marks);
            let number = |mark: &Mark| match mark {
                Mark::Label { text, .. } if text.contains(word) => text.split(' ').next()?.parse::<usize>().ok(),
                _ => None,
            };
            labels.filter_map(number).sum()
        };
        let elements = scene.groups.iter().filter(|group| group.kind == "spring_damper").count();
        assert_eq!(drawn_shafts + counted("more shaft"), 200, "{what}");
        assert_eq!(elements + counted("more element"), joins.len(), "{what}");
    }
}

#[test]
fn names_of_80_characters_are_shortened_and_shown_whole() {
    let mut mechanism = shafts(3, &[(0, 1), (1, 2)]);
    let long = |name: &str| format!("{name}_{}", "wide_name_".repeat(8));
    for part in &mut mechanism.parts {
        part.name = long(&part.name);
        part.terminals.iter_mut().for_each(|end| end.name = long(&end.name));
    }
    check_parts("long names", &mechanism);
    let picture = picture(&mechanism).expect("a picture");
    for part in &mechanism.parts {
        assert!(picture.drawing.contains(&format!(" {}</title>", part.name)), "{}", part.name);
    }
    assert!(picture.drawing.contains('…'));
}

/// A source has its positive pole at its second end: it is rotated if the first one is at ground.
#[test]
fn poles_of_a_source_are_at_their_ends() {
    let source = |ends: [(JoinKind, &str); 2]| {
        let terminals = ends.map(|(kind, name)| end("from", kind, name)).to_vec();
        let part = MechanismPart {
            kind: "voltage_source".into(),
            name: "u".into(),
            symbol: Symbol::Source,
            terminals,
            ..Default::default()
        };
        picture(&Mechanism { parts: vec![part] }).expect("a picture").drawing
    };
    let (node, ground) = ((JoinKind::Node, "n"), (JoinKind::Ground, "ground"));
    assert!(!source([node, ground]).contains("rotate(180)"));
    assert!(source([ground, node]).contains("rotate(180)"));
}

#[test]
fn a_drawing_does_not_change() {
    let mechanism = random(&mut Dice(5));
    assert_eq!(picture(&mechanism), picture(&mechanism));
    assert_eq!(picture(&Mechanism::default()), None);
}

/// Gears with backlash have two more flanks than those without, and the caption explains them.
#[test]
fn backlash_is_drawn_and_reported() {
    let gear = |laws: &[&str]| {
        let mut mechanism = shafts(2, &[(0, 1)]);
        let gear = &mut mechanism.parts[2];
        (gear.kind, gear.symbol) = ("gear".into(), Symbol::Gear);
        gear.laws = laws.iter().map(ToString::to_string).collect();
        mechanism
    };
    let shown = |mechanism: &Mechanism| caption(mechanism, &scene(&Graph::of(mechanism)));
    let (tight, loose) = (gear(&[]), gear(&["backlash"]));
    assert!(
        !shown(&tight).contains("backlash") && shown(&loose).contains("wo flanks across an end: backlash"),
        "{}",
        shown(&loose)
    );
    let drawn = |mechanism: &Mechanism| symbols::between(&mechanism.parts[2]).svg.matches("-6V6").count();
    assert_eq!(drawn(&loose), drawn(&tight) + 2);
}
