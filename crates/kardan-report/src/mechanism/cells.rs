//! A block with all its parts, around its centre: symbols, labels, the lines between them, and where lines from
//! other blocks come in.

use kardan_results::{JoinKind, MechanismPart, Symbol};

use super::graph::{Block, Content};
use super::labels::{HEIGHT, shorten, width};
use super::symbols::{self, Drawn};
use crate::text::figure;

/// Widest name beside, above or below a symbol, px.
const NAME: f64 = 130.0;
/// Tallest box, px.
const TALLEST: f64 = 360.0;
/// From one thing on a shaft to the next, px.
const PITCH: f64 = 27.0;

/// A drawn item.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Mark {
    /// A symbol at its position; optionally rotated to hang down.
    Symbol { at: (f64, f64), drawn: Drawn, hanging: bool },
    /// Horizontal and vertical lines.
    Line { points: Vec<(f64, f64)>, class: &'static str },
    /// A text with its centre, or start, at this position.
    Label { at: (f64, f64), middle: bool, class: &'static str, text: String },
    /// A box: left, top, width, height; its corners are rounded by so much.
    Box { place: [f64; 4], class: &'static str, radius: f64 },
}

/// A part with its marks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Group {
    /// Keyword of the kind of element; `node`, `folded`.
    pub(super) kind: String,
    /// Its whole name.
    pub(super) name: String,
    /// The tooltip.
    pub(super) title: String,
    pub(super) marks: Vec<Mark>,
}

/// A side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

/// An end of an element, and where its line comes from; the space that the block there needs above and below its line.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    pub(super) end: usize,
    pub(super) side: Side,
    pub(super) room: (f64, f64),
    /// The height of that block's line, where it is known.
    pub(super) line: Option<f64>,
}

/// A block, drawn around (0, 0).
#[derive(Debug, Clone, Default)]
pub(super) struct Cell {
    pub(super) groups: Vec<Group>,
    /// Its extent; lines enter at `left` and `right`.
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) above: f64,
    pub(super) below: f64,
    /// Height at which the line of each end of an element comes in, by the number of the end.
    pub(super) ports: Vec<(usize, f64)>,
}

impl Cell {
    fn reach(&mut self, [left, top, right, bottom]: [f64; 4]) {
        self.left = self.left.max(-left);
        self.right = self.right.max(right);
        self.above = self.above.max(-top);
        self.below = self.below.max(bottom);
    }

    /// The height of the line of an end.
    pub(super) fn port(&self, end: usize) -> f64 {
        self.ports.iter().find(|(own, _)| *own == end).map_or(0.0, |(_, y)| *y)
    }

    /// A line from an edge to the symbol, which reaches this far to either side.
    fn lead(&mut self, side: Side, y: f64, half: f64, class: &'static str) {
        let (edge, from) = if side == Side::Left { (-self.left, -half) } else { (self.right, half) };
        self.groups[0].marks.push(Mark::Line { points: vec![(edge, y), (from, y)], class });
    }

    /// Room for everything that was drawn, with a little air.
    fn closed(mut self) -> Self {
        let boxes: Vec<[f64; 4]> = self.groups.iter().flat_map(|group| &group.marks).map(Mark::bounds).collect();
        boxes.into_iter().for_each(|bounds| self.reach(bounds));
        (self.left, self.right) = (self.left + 5.0, self.right + 5.0);
        (self.above, self.below) = (self.above + 3.0, self.below + 3.0);
        self
    }
}

impl Mark {
    /// Left, top, right, bottom.
    pub(super) fn bounds(&self) -> [f64; 4] {
        match self {
            Self::Symbol { at: (x, y), drawn, hanging: false } => {
                [x - drawn.half, y - drawn.up, x + drawn.half, y + drawn.down]
            }
            Self::Symbol { at: (x, y), drawn, hanging: true } => {
                [x - drawn.down, y - drawn.half, x + drawn.up, y + drawn.half]
            }
            Self::Line { points, .. } => points
                .iter()
                .fold([f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY], |[a, b, c, d], &(x, y)| {
                    [a.min(x), b.min(y), c.max(x), d.max(y)]
                }),
            Self::Label { at: (x, y), middle, text, .. } => {
                let wide = width(text);
                let left = if *middle { x - 0.5 * wide } else { *x };
                [left, y - 0.8 * HEIGHT, left + wide, y + 0.25 * HEIGHT]
            }
            Self::Box { place: [x, y, wide, high], .. } => [*x, *y, x + wide, y + high],
        }
    }

    /// The same elsewhere.
    pub(super) fn moved(mut self, (dx, dy): (f64, f64)) -> Self {
        let shift = |(x, y): &mut (f64, f64)| {
            *x += dx;
            *y += dy;
        };
        match &mut self {
            Self::Symbol { at, .. } | Self::Label { at, .. } => shift(at),
            Self::Line { points, .. } => points.iter_mut().for_each(shift),
            Self::Box { place: [x, y, ..], .. } => {
                *x += dx;
                *y += dy;
            }
        }
        self
    }
}

fn symbol(at: (f64, f64), drawn: Drawn) -> Mark {
    Mark::Symbol { at, drawn, hanging: false }
}

fn line(points: &[(f64, f64)]) -> Mark {
    Mark::Line { points: points.to_vec(), class: "thin" }
}

fn label(at: (f64, f64), middle: bool, text: &str) -> Mark {
    Mark::Label { at, middle, class: "", text: shorten(text, NAME) }
}

fn group(part: &MechanismPart, marks: Vec<Mark>) -> Group {
    let values = if part.values.is_empty() { String::new() } else { format!(": {}", part.values) };
    let title = format!("{} {}{values}", part.kind.replace('_', " "), part.name);
    Group { kind: part.kind.clone(), name: part.name.clone(), title, marks }
}

/// The label of an attached item: a sensor names its quantity.
fn named(part: &MechanismPart) -> String {
    let sign = match part.laws.first().map(String::as_str) {
        _ if part.symbol != Symbol::Sensor => "",
        Some("angle") => "φ ",
        Some("speed") => "ω ",
        Some("position") => "s ",
        Some("velocity") => "v ",
        Some("force") => "F ",
        _ => "τ ",
    };
    format!("{sign}{}", part.name)
}

/// The items attached to a block, one below the other on a line that starts at (0, `top`).
fn stack(cell: &mut Cell, top: f64, first: f64, attached: &[&MechanismPart], uncounted: &[&str]) {
    for (k, part) in attached.iter().enumerate() {
        let y = first + PITCH * k as f64;
        let from = if k == 0 { top } else { y - PITCH };
        let marks = vec![
            line(&[(0.0, from), (0.0, y), (4.0, y)]),
            symbol((18.0, y), symbols::hung(part)),
            label((37.0, y + 4.0), false, &named(part)),
        ];
        cell.groups.push(group(part, marks));
    }
    if !uncounted.is_empty() {
        let y = first + PITCH * attached.len() as f64;
        let marks = vec![
            line(&[(0.0, y - PITCH), (0.0, y), (4.0, y)]),
            label((8.0, y + 4.0), false, &format!("… {} more", uncounted.len())),
        ];
        let title = uncounted.join(", ");
        cell.groups.push(Group { kind: "folded".into(), name: String::new(), title, marks });
    }
}

/// A shaft or a node; lines come from these sides.
pub(super) fn host(block: &Block<'_>, [left, right]: [bool; 2]) -> Cell {
    match &block.content {
        Content::Shaft(part) => shaft(part, block, [left, right]),
        Content::Node(name) => node(name, block, [left, right]),
        Content::Element(_) | Content::Folded(_) => Cell::default(),
    }
}

fn shaft(part: &MechanismPart, block: &Block<'_>, [left, right]: [bool; 2]) -> Cell {
    let has = |law: &str| part.laws.iter().any(|own| own == law);
    let body = match part.symbol {
        _ if !has("inertia") => symbols::dot(),
        Symbol::Mass => symbols::slab(),
        _ => symbols::disc(),
    };
    let losses = has("damping") || has("friction");
    let (up, down) = (if losses { body.up.max(symbols::bearing().up) } else { body.up }, body.down);
    let mut cell = Cell { left: 40.0, right: 40.0, above: 4.0, below: 4.0, ..Cell::default() };
    let mut motors = block.attached.iter().copied().filter(|part| part.symbol == Symbol::Motor);
    let at_left = if left { None } else { motors.next() };
    let at_right = if right { None } else { motors.next() };
    let rest: Vec<&MechanismPart> = block
        .attached
        .iter()
        .copied()
        .filter(|part| [at_left, at_right].iter().flatten().all(|motor| !std::ptr::eq(*motor, *part)))
        .collect();
    let mut ends = [-22.0, 30.0];
    let mut motors = Vec::new();
    for (k, motor) in [at_left, at_right].into_iter().enumerate() {
        let Some(motor) = motor else { continue };
        let text = shorten(&motor.name, NAME);
        let away = (0.5 * width(&text) + 12.0).max(if k == 0 { 50.0 } else { 58.0 });
        let x = if k == 0 { -away } else { away };
        ends[k] = x - 13.0 * x.signum();
        motors.push(group(motor, vec![symbol((x, 0.0), symbols::motor()), label((x, 28.0), true, &text)]));
    }
    let mut marks = vec![Mark::Line { points: vec![(ends[0], 0.0), (ends[1], 0.0)], class: "heavy" }];
    if losses {
        let at = if part.symbol == Symbol::Mass { 26.0 } else { 20.0 };
        marks.push(symbol((at, 0.0), symbols::bearing()));
    }
    marks.push(symbol((0.0, 0.0), body));
    let up = if motors.is_empty() { up } else { up.max(symbols::motor().up) };
    marks.push(Mark::Label { at: (0.0, -up - 8.0), middle: true, class: "strong", text: shorten(&part.name, NAME) });
    cell.groups.push(group(part, marks));
    cell.groups.extend(motors);
    let first = if at_right.is_some() || at_left.is_some() { 48.0 } else { 34.0 };
    stack(&mut cell, down, first, &rest, &block.uncounted);
    let mut cell = cell.closed();
    let from = if left { -cell.left } else { ends[0] };
    let until = if right { cell.right } else { ends[1] };
    cell.groups[0].marks[0] = Mark::Line { points: vec![(from, 0.0), (until, 0.0)], class: "heavy" };
    cell
}

fn node(name: &str, block: &Block<'_>, [left, right]: [bool; 2]) -> Cell {
    let mut cell = Cell { left: 14.0, right: 14.0, above: 6.0, below: 6.0, ..Cell::default() };
    let electric = |part: &&&MechanismPart| !matches!(part.symbol, Symbol::Sensor);
    let mut x = 0.0;
    let hanging: Vec<&MechanismPart> = block.attached.iter().filter(electric).copied().collect();
    let mut groups = Vec::new();
    for part in &hanging {
        let at_ground = part.terminals.first().is_some_and(|end| end.kind == JoinKind::Ground);
        let drawn = directed(part, symbols::between(part), at_ground);
        let text = shorten(&part.name, 80.0);
        let wide = width(&text);
        let at = (x + drawn.up + 5.0, 38.0);
        let reach = at.0 + wide + 24.0;
        let marks = vec![
            Mark::Symbol { at: (x, 34.0), drawn, hanging: true },
            symbol((x, 68.0), symbols::earth()),
            label(at, false, &text),
        ];
        groups.push((x, group(part, marks)));
        x = reach;
    }
    let last = groups.last().map_or(0.0, |(x, _)| *x);
    let name_above = Mark::Label { at: (0.0, -10.0), middle: true, class: "faint", text: shorten(name, 80.0) };
    let marks = vec![symbol((0.0, 0.0), symbols::dot()), name_above];
    cell.groups.push(Group { kind: "node".into(), name: name.into(), title: format!("node {name}"), marks });
    cell.groups.extend(groups.into_iter().map(|(_, group)| group));
    let mut cell = cell.closed();
    let from = if left { -cell.left } else { 0.0 };
    let until = if right { cell.right } else { last };
    if until > from {
        cell.groups[0].marks.push(line(&[(from, 0.0), (until, 0.0)]));
    }
    cell
}

/// An element between blocks, or parts that are counted.
pub(super) fn element(block: &Block<'_>, ends: &[End]) -> Cell {
    match &block.content {
        Content::Element(part) if part.symbol == Symbol::Gear && ends.len() == 2 => gear(part, block, ends),
        Content::Element(part) if icon_needed(part, ends) => boxed(part, block, ends),
        Content::Element(part) => inline(part, block, ends),
        Content::Folded([hosts, elements]) => folded(hosts, elements, ends),
        Content::Shaft(_) | Content::Node(_) => Cell::default(),
    }
}

fn icon_needed(part: &MechanismPart, ends: &[End]) -> bool {
    let always =
        matches!(part.symbol, Symbol::StrainWaveGear | Symbol::PlanetaryGear | Symbol::Transformer | Symbol::Machine);
    always || ends.len() > 2 || part.symbol == Symbol::Relation
}

/// Name and ratio above a symbol that reaches up so far.
fn heading(part: &MechanismPart, up: f64) -> Vec<Mark> {
    let ratio = part.ratio.map(|ratio| format!("i = {}", figure(ratio, 6)));
    let rise = if ratio.is_some() { 15.0 } else { 0.0 };
    let mut marks = vec![label((0.0, -up - 7.0 - rise), true, &part.name)];
    marks.extend(ratio.map(|text| Mark::Label { at: (0.0, -up - 7.0), middle: true, class: "faint", text }));
    marks
}

fn gear(part: &MechanismPart, block: &Block<'_>, ends: &[End]) -> Cell {
    let mut cell = Cell { left: 18.0, right: 18.0, ..Cell::default() };
    let fast = part.ratio.map_or(1.0, f64::abs);
    let [first, second] = match fast {
        fast if fast > 1.2 => [18.0, 38.0],
        fast if fast < 1.0 / 1.2 => [38.0, 18.0],
        _ => [28.0, 28.0],
    };
    let wheel = |top: f64, high: f64| {
        let middle = top + 0.5 * high;
        format!(
            "<rect class=\"wheel\" x=\"-6\" y=\"{top}\" width=\"12\" height=\"{high}\" rx=\"1\"/>\
             <path class=\"thin\" d=\"M-3 {middle}H3\"/>"
        )
    };
    let svg = wheel(-0.5 * first, first) + &wheel(0.5 * first, second);
    let drawn = Drawn { svg, half: 6.0, up: 0.5 * first, down: 0.5 * first + second };
    let heights = [0.0, 0.5 * (first + second)];
    let mut marks = heading(part, drawn.up);
    let bottom = drawn.down;
    cell.ports = ends.iter().map(|one| (one.end, heights[one.end.min(1)])).collect();
    marks.push(symbol((0.0, 0.0), drawn));
    cell.groups.push(group(part, marks));
    stack(&mut cell, bottom, bottom + 16.0, &block.attached, &block.uncounted);
    let mut cell = cell.closed();
    for one in ends {
        cell.lead(one.side, heights[one.end.min(1)], 6.0, "heavy");
    }
    cell
}

/// Shafts are drawn heavier than wires.
fn weight(part: &MechanismPart, ends: &[End]) -> &'static str {
    let wire = ends.iter().any(|one| part.terminals.get(one.end).is_some_and(|end| end.kind == JoinKind::Node));
    if wire { "thin" } else { "heavy" }
}

/// A source rotated so that its poles match its ends.
fn directed(part: &MechanismPart, drawn: Drawn, reversed: bool) -> Drawn {
    match matches!(part.symbol, Symbol::Source | Symbol::CurrentSource) && reversed {
        true => Drawn { svg: format!("<g transform=\"rotate(180)\">{}</g>", drawn.svg), ..drawn },
        false => drawn,
    }
}

/// A symbol on a line; where both ends come from one side, the second line goes around below.
fn inline(part: &MechanismPart, block: &Block<'_>, ends: &[End]) -> Cell {
    let mut cell = Cell::default();
    let drawn = symbols::between(part);
    let (half, up, down) = (drawn.half, drawn.up, drawn.down);
    let reversed = ends.first().is_some_and(|one| (one.end == 0) == (one.side == Side::Right));
    let drawn = directed(part, drawn, reversed);
    let mut marks = heading(part, up);
    marks.push(symbol((0.0, 0.0), drawn));
    cell.groups.push(group(part, marks));
    stack(&mut cell, down, down + 16.0, &block.attached, &block.uncounted);
    let mut cell = cell.closed();
    let class = weight(part, ends);
    if let [first, second] = ends
        && first.side == second.side
    {
        let way = if first.side == Side::Left { 1.0 } else { -1.0 };
        let turning_x = if way > 0.0 { cell.right } else { cell.left } + 2.0;
        let low = cell.below + 8.0;
        let near = -way * if way > 0.0 { cell.left } else { cell.right };
        let first_end = vec![(near, 0.0), (-way * half, 0.0)];
        let second_end = vec![(near, low), (way * turning_x, low), (way * turning_x, 0.0), (way * half, 0.0)];
        cell.groups[0].marks.extend([first_end, second_end].map(|points| Mark::Line { points, class }));
        cell.ports = vec![(first.end, 0.0), (second.end, low)];
        if way > 0.0 {
            cell.right = turning_x + 4.0
        } else {
            cell.left = turning_x + 4.0
        };
        cell.below = low + 6.0;
        return cell;
    }
    for (side, reach) in [(Side::Left, cell.left), (Side::Right, cell.right)] {
        if ends.iter().any(|one| one.side == side) && (reach - half).abs() > 0.1 {
            cell.lead(side, 0.0, half, class);
        }
    }
    cell.ports = ends.iter().map(|one| (one.end, 0.0)).collect();
    cell
}

/// What an end of a box is called inside it: its coefficient, or the first letters of its key.
fn short_end(part: &MechanismPart, end: usize) -> String {
    let Some(terminal) = part.terminals.get(end) else { return String::new() };
    match terminal.coefficient {
        Some(factor) => figure(factor, 4),
        // All ends of a relation have the same role.
        None if part.symbol == Symbol::Relation => String::new(),
        // `flexspline` is one word where `circular_spline` is two.
        None => {
            let text = terminal.key.replace("spline", "_spline");
            text.split('_').filter_map(|word| word.chars().next()).flat_map(char::to_uppercase).collect()
        }
    }
}

/// Heights of ends on one side: where the lines of the blocks there are, if those are near; else so far apart that they have room.
fn heights(ends: &[&End]) -> Vec<f64> {
    let lines: Vec<f64> = ends.iter().filter_map(|one| one.line).collect();
    if let [first, .., last] = lines[..]
        && lines.len() == ends.len()
        && last - first <= TALLEST
        && lines.windows(2).all(|pair| pair[1] - pair[0] >= 20.0)
    {
        return lines.iter().map(|y| y - 0.5 * (first + last)).collect();
    }
    let mut out = Vec::with_capacity(ends.len());
    let mut y = 0.0;
    for (k, one) in ends.iter().enumerate() {
        if k > 0 {
            y += (ends[k - 1].room.1 + one.room.0 + 18.0).clamp(36.0, 170.0);
        }
        out.push(y);
    }
    out.iter().map(|height| height - 0.5 * y).collect()
}

/// A box with its ends at both sides.
fn boxed(part: &MechanismPart, block: &Block<'_>, ends: &[End]) -> Cell {
    let mut cell = Cell::default();
    let ground = |end: &usize| part.terminals[*end].kind == JoinKind::Ground;
    let grounds: Vec<usize> = (0..part.terminals.len()).filter(ground).collect();
    // A grounded end is drawn below the others of its winding.
    let far_side = |end: usize| ends.iter().find(|one| one.end / 2 == end / 2).map_or(Side::Left, |one| one.side);
    let mut high: f64 = 22.0;
    let mut placed: Vec<(usize, Side, f64, bool)> = Vec::new();
    for side in [Side::Left, Side::Right] {
        let here: Vec<&End> = ends.iter().filter(|one| one.side == side).collect();
        let ys = heights(&here);
        let mut low = ys.last().copied().unwrap_or(-32.0);
        placed.extend(here.iter().zip(&ys).map(|(one, y)| (one.end, side, *y, false)));
        for &end in grounds.iter().filter(|&&end| far_side(end) == side) {
            low += 32.0;
            placed.push((end, side, low, true));
        }
        high = placed.iter().map(|(_, _, y, _)| y.abs() + 14.0).fold(high, f64::max);
    }
    let texts: Vec<String> = placed.iter().map(|(end, ..)| short_end(part, *end)).collect();
    let half = texts.iter().map(|text| width(text)).fold(0.0, f64::max) + 10.0 + 17.0 * (high / 36.0).clamp(1.0, 1.7);
    let mut marks = heading(part, high);
    marks.push(Mark::Box { place: [-half, -high, 2.0 * half, 2.0 * high], class: "box", radius: 3.0 });
    if let Some(svg) = symbols::icon(part.symbol) {
        let size = (high / 36.0).clamp(1.0, 1.7);
        let svg = format!("<g transform=\"scale({size:.2})\">{svg}</g>");
        marks.push(symbol((0.0, 0.0), Drawn { svg, half: 15.0 * size, up: 17.0 * size, down: 17.0 * size }));
    }
    for ((_, side, y, grounded), text) in placed.iter().zip(texts) {
        let wide = width(&text);
        let way = if *side == Side::Left { -1.0 } else { 1.0 };
        let middle = way * (half - 6.0 - 0.5 * wide);
        marks.push(Mark::Label { at: (middle, y + 4.0), middle: true, class: "faint", text });
        if *grounded {
            marks.push(line(&[(way * half, *y), (way * (half + 10.0), *y)]));
            marks.push(symbol((way * (half + 10.0), *y), symbols::earth()));
        }
    }
    cell.groups.push(group(part, marks));
    stack(&mut cell, high, high + 16.0, &block.attached, &block.uncounted);
    let mut cell = cell.closed();
    for (_, side, y, _) in placed.iter().filter(|(.., grounded)| !grounded) {
        cell.lead(*side, *y, half, weight(part, ends));
    }
    cell.ports = placed.iter().map(|(end, _, y, _)| (*end, *y)).collect();
    cell
}

fn folded(hosts: &[&str], elements: &[&str], ends: &[End]) -> Cell {
    let count = |count: usize, one: &str| match count {
        0 => None,
        1 => Some(format!("1 {one}")),
        count => Some(format!("{count} {one}s")),
    };
    let texts: Vec<String> =
        [count(hosts.len(), "more shaft"), count(elements.len(), "more element")].into_iter().flatten().collect();
    let half = texts.iter().map(|text| width(text)).fold(40.0, f64::max) * 0.5 + 14.0;
    let mut placed = Vec::new();
    let mut high: f64 = 24.0;
    for side in [Side::Left, Side::Right] {
        let here: Vec<&End> = ends.iter().filter(|one| one.side == side).collect();
        placed.extend(here.iter().zip(heights(&here)).map(|(one, y)| (one.end, side, y)));
    }
    high = placed.iter().map(|(_, _, y)| y.abs() + 10.0).fold(high, f64::max);
    let place = [-half, -high, 2.0 * half, 2.0 * high];
    let mut marks = vec![Mark::Box { place, class: "folded", radius: 6.0 }];
    let top = -0.5 * 16.0 * (texts.len() as f64 - 1.0) + 4.0;
    for (k, text) in texts.into_iter().enumerate() {
        marks.push(Mark::Label { at: (0.0, top + 16.0 * k as f64), middle: true, class: "faint", text });
    }
    let names: Vec<&str> = hosts.iter().chain(elements).copied().take(200).collect();
    let title = names.join(", ") + if hosts.len() + elements.len() > names.len() { ", …" } else { "" };
    let mut cell = Cell::default();
    cell.groups.push(Group { kind: "folded".into(), name: String::new(), title, marks });
    let mut cell = cell.closed();
    for (_, side, y) in &placed {
        cell.lead(*side, *y, half, "thin");
    }
    cell.ports = placed.iter().map(|&(end, _, y)| (end, y)).collect();
    cell
}
