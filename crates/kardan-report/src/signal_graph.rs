//! Blocks and their connections as a picture: a box for each, from left to right in signal order.

use std::collections::BTreeMap;

use kardan_results::SignalNode;

use crate::drawing::{bar, cut, text};
use crate::model::{Body, Picture, row};
use crate::text::{number, with_unit};

/// Width and height of a box, and the room between columns and between rows, px.
const BOX: [f64; 2] = [184.0, 40.0];
/// Width of the names of external inputs, px.
const NAMES: f64 = 120.0;
const BETWEEN: [f64; 2] = [64.0, 16.0];
/// Width of a letter, px: longer names are cut.
const LETTER: f64 = 6.6;
const MARGIN: f64 = 8.0;
/// Distance of two feedback lines, px.
const LANE: f64 = 9.0;

/// An end of a line: an external input, or a node by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Place<'a> {
    Outside(&'a str),
    Node(usize),
}

/// The owner of a name.
fn place<'a>(nodes: &'a [SignalNode], name: &'a str) -> Place<'a> {
    let own = |node: &SignalNode| node.kind != "program" && node.outputs.iter().any(|output| output.name == name);
    nodes.iter().position(own).map_or(Place::Outside(name), Place::Node)
}

/// The column of each node: right of all its inputs except feedback.
fn columns(nodes: &[SignalNode]) -> Vec<usize> {
    fn visit(nodes: &[SignalNode], node: usize, open: &mut Vec<usize>, found: &mut [usize]) {
        if found[node] > 0 || open.contains(&node) {
            return;
        }
        open.push(node);
        let mut column = 1;
        for name in &nodes[node].reads {
            if let Place::Node(source) = place(nodes, name) {
                visit(nodes, source, open, found);
                column = column.max(found[source] + 1);
            }
        }
        open.pop();
        found[node] = column;
    }
    let mut found = vec![0; nodes.len()];
    for node in 0..nodes.len() {
        visit(nodes, node, &mut Vec::new(), &mut found);
    }
    found
}

/// Positions: the upper left corner of each box.
fn places(nodes: &[SignalNode]) -> BTreeMap<Place<'_>, [f64; 2]> {
    let of_node = columns(nodes);
    let mut columns: Vec<Vec<Place<'_>>> = vec![Vec::new(); of_node.iter().max().map_or(1, |last| last + 1)];
    for (k, node) in nodes.iter().enumerate() {
        columns[of_node[k]].push(Place::Node(k));
        for outside in node.reads.iter().map(|name| place(nodes, name)) {
            if matches!(outside, Place::Outside(_)) && !columns[0].contains(&outside) {
                columns[0].push(outside);
            }
        }
    }
    let mut found: BTreeMap<Place<'_>, [f64; 2]> = BTreeMap::new();
    for (column, all) in columns.iter_mut().enumerate() {
        // At the average height of its inputs.
        let height = |one: &Place<'_>| {
            let Place::Node(k) = one else { return 0.0 };
            let read = nodes[*k].reads.iter().filter_map(|name| found.get(&place(nodes, name)));
            let heights: Vec<f64> = read.map(|at| at[1]).collect();
            heights.iter().sum::<f64>() / heights.len().max(1) as f64
        };
        let mut heights: Vec<(f64, Place<'_>)> = all.iter().map(|one| (height(one), *one)).collect();
        heights.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (row, (_, one)) in heights.into_iter().enumerate() {
            // The names on the left start where the boxes end.
            let x = MARGIN + column as f64 * (BOX[0] + BETWEEN[0]) - (BOX[0] - NAMES);
            found.insert(one, [x, MARGIN + row as f64 * (BOX[1] + BETWEEN[1])]);
        }
    }
    found
}

fn short(name: &str) -> String {
    cut(name, ((BOX[0] - 10.0) / LETTER) as usize)
}

fn when(node: &SignalNode) -> String {
    node.sample_time.map_or("every instant".into(), |time| match time < 1.0 {
        true => format!("{}\u{a0}ms", number(1e3 * time)),
        false => format!("{}\u{a0}s", number(time)),
    })
}

/// The drawing; none without blocks.
fn picture(nodes: &[SignalNode]) -> Option<Picture> {
    if nodes.is_empty() {
        return None;
    }
    let places = places(nodes);
    let low = places.values().fold(0.0, |low: f64, at| low.max(at[1])) + BOX[1];
    let right = places.values().fold(0.0, |right: f64, at| right.max(at[0])) + BOX[0];
    let (mut lines, mut boxes, mut lanes) = (String::new(), String::new(), 0.0);
    for (k, node) in nodes.iter().enumerate() {
        let [x, y] = places[&Place::Node(k)];
        // A block that reads its own output gets no line.
        let reads: Vec<Place<'_>> =
            node.reads.iter().map(|name| place(nodes, name)).filter(|read| *read != Place::Node(k)).collect();
        let count = reads.len() as f64;
        for (port, read) in reads.iter().enumerate() {
            let from = places[read];
            let (a, b) = (from[0] + BOX[0], from[1] + 0.5 * BOX[1]);
            let (c, d) = (x, y + BOX[1] * (port as f64 + 1.0) / (count + 1.0));
            let half = 0.5 * BETWEEN[0];
            lines += &if a < c {
                format!("<path d=\"M{a:.1} {b:.1}C{:.1} {b:.1} {:.1} {d:.1} {c:.1} {d:.1}\"/>\n", a + half, c - half)
            } else {
                lanes += 1.0;
                let lane = low + LANE * lanes;
                let [out, into] = [a + 0.3 * half, c - 0.3 * half];
                format!("<path class=\"back\" d=\"M{a:.1} {b:.1}H{out:.1}V{lane:.1}H{into:.1}V{d:.1}H{c:.1}\"/>\n")
            };
            lines += &format!("<path class=\"tip\" d=\"M{c:.1} {d:.1}l-6 -3.5v7z\"/>\n");
        }
        let class = if node.kind == "program" { "box program" } else { "box" };
        let kind = node.kind.replace('_', " ");
        let title = format!("{} ({kind}), {}", node.name, when(node));
        boxes += &bar(x, y, BOX[0], BOX[1], class, &title);
        boxes += &text(x + 0.5 * BOX[0], y + 17.0, "middle strong", &short(&node.name));
        boxes += &text(x + 0.5 * BOX[0], y + 32.0, "middle faint", &short(&format!("{kind}, {}", when(node))));
    }
    for (place, [x, y]) in &places {
        if let Place::Outside(name) = place {
            boxes += &text(x + BOX[0] - 4.0, y + 0.5 * BOX[1] + 4.0, "end", &short(name));
        }
    }
    let height = low + LANE * lanes + MARGIN;
    let label = format!("{} blocks and their inputs", nodes.len());
    let caption = "Blocks, from left to right in signal order: the kind of each, and when it computes. On the left \
                   their external inputs; dashed: feedback to a block that computes earlier.";
    Some(Picture::drawn("", [right + MARGIN, height], &label, &(lines + &boxes), caption).of_class("signals"))
}

/// The graph of the signals of a model: drawn, and as a table.
pub(super) fn body(nodes: &[SignalNode]) -> Body {
    let rows = nodes.iter().map(|node| {
        let outputs: Vec<String> = node.outputs.iter().map(|output| with_unit(&output.name, &output.unit)).collect();
        row![&node.name, node.kind.replace('_', " "), when(node), node.order, outputs.join(", "), node.reads.join(", ")]
    });
    let columns = ["block", "kind", "sample time", "#order", "answers", "reads"];
    let table = Body::default().table(&columns, rows);
    Body::default().detail(Body::default().pictures(picture(nodes)).fold("Blocks as a table", table))
}

#[cfg(test)]
#[path = "../tests/unit/signal_graph.rs"]
mod tests;
