//! Positions of blocks and routes of lines: connected parts in layers from left to right, by their distance from one end, in bands
//! if they are long. Blocks do not overlap, and lines bend only in channels between layers, so no line crosses a label.

use std::collections::BTreeMap;

use super::cells::{Cell, End, Group, Mark, Side, element, host};
use super::graph::{Content, Graph, reached};

/// Widest band, px.
const WIDEST: f64 = 1080.0;
/// Between two blocks of a layer, px.
const BETWEEN: f64 = 14.0;
/// From one line of a channel to the next, px.
const TRACK: f64 = 9.0;
/// Between two connected parts, px.
const APART: f64 = 26.0;

/// All drawn items, with their size.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Scene {
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) groups: Vec<Group>,
    pub(super) wires: Vec<Mark>,
}

impl Scene {
    fn marks(&self) -> impl Iterator<Item = &Mark> {
        self.groups.iter().flat_map(|group| &group.marks).chain(&self.wires)
    }

    /// The same with its upper left corner at (0, 0).
    fn closed(self) -> Self {
        let far = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        let [left, top, right, bottom] = self
            .marks()
            .map(Mark::bounds)
            .fold(far, |[a, b, c, d], [l, t, r, e]| [a.min(l), b.min(t), c.max(r), d.max(e)]);
        if right < left {
            return Self::default();
        }
        Self { width: right - left, height: bottom - top, ..self.moved((-left, -top)) }
    }

    fn moved(mut self, by: (f64, f64)) -> Self {
        for group in &mut self.groups {
            group.marks = std::mem::take(&mut group.marks).into_iter().map(|mark| mark.moved(by)).collect();
        }
        self.wires = self.wires.into_iter().map(|mark| mark.moved(by)).collect();
        self
    }
}

/// The drawing of a graph: its connected parts in rows.
pub(super) fn scene(graph: &Graph<'_>) -> Scene {
    let mut out = Scene::default();
    let (mut x, mut y, mut high) = (0.0, 0.0, 0.0f64);
    for component in graph.components() {
        let part = Component::new(graph, &component).scene();
        if x > 0.0 && x + part.width > WIDEST {
            (x, y, high) = (0.0, y + high + APART, 0.0);
        }
        let (width, height) = (part.width, part.height);
        let part = part.moved((x, y));
        out.groups.extend(part.groups);
        out.wires.extend(part.wires);
        x += width + APART;
        high = high.max(height);
    }
    out.closed()
}

/// A connected part on its way to a drawing.
struct Component<'a> {
    graph: &'a Graph<'a>,
    /// Blocks from left to right, in each layer from top to bottom.
    layers: Vec<Vec<usize>>,
    /// Whether distances count from the right.
    mirrored: bool,
    /// Layer of a block.
    layer: BTreeMap<usize, usize>,
    cells: BTreeMap<usize, Cell>,
    /// Height of the line of a block.
    y: BTreeMap<usize, f64>,
}

/// A line from a block to one of the next layer.
#[derive(Debug, Clone, Copy)]
struct Wire {
    from: usize,
    to: usize,
    start: f64,
    end: f64,
    heavy: bool,
}

impl Wire {
    fn turns(&self) -> bool {
        (self.start - self.end).abs() > 0.5
    }
}

impl<'a> Component<'a> {
    fn new(graph: &'a Graph<'a>, blocks: &[usize]) -> Self {
        let neighbours = graph.neighbours();
        let (layers, mirrored) = layered(graph, &neighbours, blocks);
        let layer = layers.iter().enumerate().flat_map(|(k, all)| all.iter().map(move |&block| (block, k))).collect();
        let mut out = Self { graph, layers, mirrored, layer, cells: BTreeMap::new(), y: BTreeMap::new() };
        out.make_cells(&neighbours);
        out.arrange();
        out
    }

    fn make_cells(&mut self, neighbours: &[Vec<usize>]) {
        let all: Vec<usize> = self.layers.iter().flatten().copied().collect();
        let hosts = all.iter().filter(|&&block| self.graph.blocks[block].is_host());
        for &block in hosts {
            let at = self.layer[&block];
            let left = neighbours[block].iter().any(|neighbour| self.layer[neighbour] < at);
            let right = neighbours[block].iter().any(|neighbour| self.layer[neighbour] > at);
            self.cells.insert(block, host(&self.graph.blocks[block], [left, right]));
        }
        for &block in all.iter().filter(|&&block| !self.graph.blocks[block].is_host()) {
            self.make_element(block);
        }
    }

    /// The cell of an element, whose ends lie where the lines of its hosts are, as far as that is known.
    fn make_element(&mut self, block: usize) {
        let joins = self.graph.joins.iter().filter(|join| join.element == block);
        let mut ends: Vec<(usize, End)> = joins
            .map(|join| {
                let layer = self.layer[&join.host];
                let side = if layer < self.layer[&block] { Side::Left } else { Side::Right };
                let place = self.layers[layer].iter().position(|&candidate| candidate == join.host);
                let room = self.cells.get(&join.host).map_or((0.0, 0.0), |cell| (cell.above, cell.below));
                let line = self.y.get(&join.host).copied();
                (place.unwrap_or(0), End { end: join.end, side, room, line })
            })
            .collect();
        ends.sort_by_key(|(place, one)| (one.side == Side::Right, *place, one.end));
        let ends: Vec<End> = ends.into_iter().map(|(_, one)| one).collect();
        self.cells.insert(block, element(&self.graph.blocks[block], &ends));
    }

    /// Heights: each block as near as there is room to where its lines come from.
    fn arrange(&mut self) {
        let order: Vec<usize> = match self.mirrored {
            true => (0..self.layers.len()).rev().collect(),
            false => (0..self.layers.len()).collect(),
        };
        for (step, &k) in order.iter().enumerate() {
            let before = step.checked_sub(1).map(|step| order[step]);
            for block in self.layers[k].clone() {
                if !self.graph.blocks[block].is_host() {
                    self.make_element(block);
                }
            }
            let desired: Vec<f64> = self.layers[k].iter().map(|&block| self.desired(block, before)).collect();
            let room: Vec<(f64, f64)> =
                self.layers[k].iter().map(|block| (self.cells[block].above, self.cells[block].below)).collect();
            for (&block, y) in self.layers[k].iter().zip(spread(&desired, &room)) {
                self.y.insert(block, y);
            }
        }
    }

    fn desired(&self, block: usize, before: Option<usize>) -> f64 {
        let joins = self.graph.joins.iter().filter(|join| join.element == block || join.host == block);
        let heights: Vec<f64> = joins
            .filter_map(|join| {
                let own = join.element == block;
                let far_end = if own { join.host } else { join.element };
                if Some(self.layer[&far_end]) != before {
                    return None;
                }
                let port = self.cells[&join.element].port(join.end);
                Some(self.y.get(&far_end)? + if own { -port } else { port })
            })
            .collect();
        if heights.is_empty() { 0.0 } else { heights.iter().sum::<f64>() / heights.len() as f64 }
    }

    /// The lines between a layer and the next, in an order in which their vertical parts may stand side by side.
    fn channel(&self, left: usize) -> Vec<Wire> {
        let mut wires: Vec<Wire> = Vec::new();
        for join in &self.graph.joins {
            let (Some(&element), Some(&host)) = (self.layer.get(&join.element), self.layer.get(&join.host)) else {
                continue;
            };
            if element.min(host) != left {
                continue;
            }
            let port = self.y[&join.element] + self.cells[&join.element].port(join.end);
            let line = self.y[&join.host];
            let heavy = matches!(self.graph.blocks[join.host].content, Content::Shaft(_));
            wires.push(match element < host {
                true => Wire { from: join.element, to: join.host, start: port, end: line, heavy },
                false => Wire { from: join.host, to: join.element, start: line, end: port, heavy },
            });
        }
        wires.sort_by(|a, b| a.start.total_cmp(&b.start).then(a.end.total_cmp(&b.end)));
        let mut out = Vec::with_capacity(wires.len());
        while !wires.is_empty() {
            // A line that ends at the height where another starts bends after that one.
            let free = |k: usize| {
                let wire = wires[k];
                !wires.iter().any(|crossing| {
                    crossing.from != wire.from && (crossing.start - wire.end).abs() < 3.0 && crossing.turns()
                })
            };
            let next = (0..wires.len()).find(|&k| free(k)).unwrap_or(0);
            out.push(wires.remove(next));
        }
        out
    }

    /// Layers in bands, each no wider than there is room.
    fn bands(&self, channels: &[Vec<Wire>]) -> Vec<Vec<(usize, f64)>> {
        let mut bands: Vec<Vec<(usize, f64)>> = Vec::new();
        let mut x = 0.0;
        for (k, layer) in self.layers.iter().enumerate() {
            let reach = |of: fn(&Cell) -> f64| layer.iter().map(|block| of(&self.cells[block])).fold(0.0, f64::max);
            let (left, right) = (reach(|cell| cell.left), reach(|cell| cell.right));
            let gap = if k == 0 { 0.0 } else { channel_width(&channels[k - 1]) };
            match bands.last_mut() {
                Some(band) if x + gap + left + right <= WIDEST => {
                    band.push((k, x + gap + left));
                    x += gap + left + right;
                }
                _ => {
                    bands.push(vec![(k, left)]);
                    x = left + right;
                }
            }
        }
        bands
    }

    fn scene(&self) -> Scene {
        let channels: Vec<Vec<Wire>> =
            (0..self.layers.len().saturating_sub(1)).map(|left| self.channel(left)).collect();
        let bands = self.bands(&channels);
        let mut centre: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        let mut top = 0.0;
        let mut out = Scene::default();
        let mut pending: Vec<(Wire, f64)> = Vec::new();
        let mut widest = 0.0f64;
        for (b, band) in bands.iter().enumerate() {
            let blocks = || band.iter().flat_map(|&(k, x)| self.layers[k].iter().map(move |&block| (block, x)));
            let high =
                blocks().map(|(block, _)| self.y[&block] - self.cells[&block].above).fold(f64::INFINITY, f64::min);
            let low =
                blocks().map(|(block, _)| self.y[&block] + self.cells[&block].below).fold(f64::NEG_INFINITY, f64::max);
            for (block, x) in blocks() {
                centre.insert(block, (x, self.y[&block] + top - high));
                widest = widest.max(x + self.cells[&block].right);
            }
            for pair in band.windows(2) {
                let [(left, at), _] = [pair[0], pair[1]];
                let right = self.layers[left].iter().map(|block| self.cells[block].right).fold(0.0, f64::max);
                out.wires.extend(self.routed(&channels[left], at + right, top - high));
            }
            top += low - high + 22.0;
            if let Some(&(last, _)) = band.last()
                && b + 1 < bands.len()
            {
                pending.extend(channels[last].iter().enumerate().map(|(k, wire)| (*wire, top + TRACK * k as f64)));
                top += TRACK * channels[last].len() as f64 + 14.0;
            }
        }
        for (k, (wire, gap)) in pending.iter().enumerate() {
            out.wires.push(self.detour(*wire, *gap, k, &centre, widest));
        }
        for (block, at) in &centre {
            let groups = self.cells[block].groups.iter().cloned();
            out.groups.extend(groups.map(|group| {
                let marks = group.marks.into_iter().map(|mark| mark.moved(*at)).collect();
                Group { marks, ..group }
            }));
        }
        out.closed()
    }

    /// Lines within a band: each has its own track for its vertical part.
    fn routed(&self, wires: &[Wire], channel: f64, shift: f64) -> Vec<Mark> {
        let width = channel_width(wires);
        let mut track = channel + 8.0;
        let mut out = Vec::new();
        for wire in wires {
            let from = channel - self.slack(wire.from, |cell| cell.right);
            let to = channel + width + self.slack(wire.to, |cell| cell.left);
            let (start, end) = (wire.start + shift, wire.end + shift);
            let points = if wire.turns() {
                let x = track;
                track += TRACK;
                vec![(from, start), (x, start), (x, end), (to, end)]
            } else {
                vec![(from, start), (to, start)]
            };
            out.push(Mark::Line { points, class: if wire.heavy { "heavy" } else { "thin" } });
        }
        out
    }

    /// How far a block stays behind the widest of its layer.
    fn slack(&self, block: usize, of: fn(&Cell) -> f64) -> f64 {
        let widest = self.layers[self.layer[&block]].iter().map(|stacked| of(&self.cells[stacked])).fold(0.0, f64::max);
        widest - of(&self.cells[&block])
    }

    /// A line from the end of a band to the begin of the next.
    fn detour(&self, wire: Wire, gap: f64, k: usize, centre: &BTreeMap<usize, (f64, f64)>, widest: f64) -> Mark {
        let (from, to) = (centre[&wire.from], centre[&wire.to]);
        let start = from.1 + wire.start - self.y[&wire.from];
        let end = to.1 + wire.end - self.y[&wire.to];
        let right = widest + 8.0 + TRACK * k as f64;
        let left = -8.0 - TRACK * k as f64;
        let points = vec![
            (from.0 + self.cells[&wire.from].right, start),
            (right, start),
            (right, gap),
            (left, gap),
            (left, end),
            (to.0 - self.cells[&wire.to].left, end),
        ];
        Mark::Line { points, class: if wire.heavy { "heavy" } else { "thin" } }
    }
}

/// Width of the vertical lines of a channel.
fn channel_width(wires: &[Wire]) -> f64 {
    match wires.iter().filter(|wire| wire.turns()).count() {
        0 => 0.0,
        count => 16.0 + TRACK * (count as f64 - 1.0),
    }
}

/// Heights as close as possible (least squares) to the desired ones, in the same order, with space for each.
fn spread(desired: &[f64], room: &[(f64, f64)]) -> Vec<f64> {
    let mut offset = vec![0.0; desired.len()];
    for k in 1..desired.len() {
        offset[k] = offset[k - 1] + room[k - 1].1 + room[k].0 + BETWEEN;
    }
    // What is out of order shares its mean: pool adjacent violators.
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for (desired, offset) in desired.iter().zip(&offset) {
        let mut pool = (desired - offset, 1);
        while let Some(&(sum, count)) = pools.last()
            && sum / count as f64 > pool.0 / pool.1 as f64
        {
            pools.pop();
            pool = (pool.0 + sum, pool.1 + count);
        }
        pools.push(pool);
    }
    let means = pools.iter().flat_map(|&(sum, count)| std::iter::repeat_n(sum / count as f64, count));
    means.zip(offset).map(|(mean, offset)| mean + offset).collect()
}

/// Layers from left to right, ordered from top to bottom, and whether they count from the right: from one end of the longest way,
/// so that sources are on the left.
fn layered(graph: &Graph<'_>, neighbours: &[Vec<usize>], blocks: &[usize]) -> (Vec<Vec<usize>>, bool) {
    let farthest = |start: usize| {
        let found = reached(neighbours, start);
        let far = found.iter().map(|(_, distance)| *distance).max().unwrap_or(0);
        found.iter().filter(|(_, distance)| *distance == far).map(|(block, _)| *block).min().unwrap_or(start)
    };
    let first = farthest(blocks[0]);
    let second = farthest(first);
    let mut best: Option<([usize; 3], Vec<Vec<usize>>, bool)> = None;
    for (root, mirrored) in [(first, false), (second, false), (first, true), (second, true)] {
        let found = reached(neighbours, root);
        let deep = found.iter().map(|(_, distance)| *distance).max().unwrap_or(0);
        let place = |distance: usize| if mirrored { deep - distance } else { distance };
        let driven = found.iter().filter(|(block, _)| graph.blocks[*block].drives());
        let score = driven.map(|(_, distance)| place(*distance)).sum();
        let layers = ordered(neighbours, &found, deep);
        let most = layers.iter().map(Vec::len).max().unwrap_or(0);
        let last = if mirrored { layers.first() } else { layers.last() };
        let rank = [score, most, last.map_or(0, Vec::len)];
        if best.as_ref().is_none_or(|(lowest, ..)| rank < *lowest) {
            best = Some((rank, layers, mirrored));
        }
    }
    let (_, mut layers, mirrored) = best.unwrap_or(([0; 3], Vec::new(), false));
    if mirrored {
        layers.reverse();
    }
    (layers, mirrored)
}

/// Blocks by their distance, each layer in the order of where its lines come from.
fn ordered(neighbours: &[Vec<usize>], found: &[(usize, usize)], deep: usize) -> Vec<Vec<usize>> {
    let mut layers: Vec<Vec<usize>> = vec![Vec::new(); deep + 1];
    for (block, distance) in found {
        layers[*distance].push(*block);
    }
    for k in 1..layers.len() {
        let (before, after) = layers.split_at_mut(k);
        let place: BTreeMap<usize, usize> = before[k - 1].iter().enumerate().map(|(at, &block)| (block, at)).collect();
        let mean = |block: usize| {
            let places: Vec<usize> =
                neighbours[block].iter().filter_map(|neighbour| place.get(neighbour).copied()).collect();
            places.iter().sum::<usize>() as f64 / places.len().max(1) as f64
        };
        after[0].sort_by(|&a, &b| mean(a).total_cmp(&mean(b)));
    }
    layers
}
