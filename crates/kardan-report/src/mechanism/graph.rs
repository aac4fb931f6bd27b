//! The drawn graph: blocks, attached items, and connections between blocks; large models folded.

use std::collections::{BTreeMap, BTreeSet};

use kardan_results::{JoinKind, Mechanism, MechanismPart, Symbol, Terminal};

/// Models of more shafts and nodes are folded.
const HOSTS: usize = 30;
/// Largest number of blocks at the same distance from the start.
const MOST_PARALLEL: usize = 8;
/// Longer rows of equally built shafts are folded.
const ROW: usize = 5;
/// More things on one shaft are counted.
const ATTACHED: usize = 12;

/// The content of a block.
#[derive(Debug)]
pub(super) enum Content<'a> {
    /// A shaft.
    Shaft(&'a MechanismPart),
    /// A node of a circuit.
    Node(&'a str),
    /// An element between shafts or nodes.
    Element(&'a MechanismPart),
    /// Parts that are counted: names of shafts and nodes, names of elements.
    Folded([Vec<&'a str>; 2]),
}

/// A block with its attached items.
#[derive(Debug)]
pub(super) struct Block<'a> {
    pub(super) content: Content<'a>,
    pub(super) attached: Vec<&'a MechanismPart>,
    /// Number of further attached items.
    pub(super) uncounted: Vec<&'a str>,
}

/// A line from an end of an element to a shaft or node.
#[derive(Debug, Clone, Copy)]
pub(super) struct Join {
    /// Block of the element.
    pub(super) element: usize,
    /// Which of its ends.
    pub(super) end: usize,
    /// Block of the shaft or node.
    pub(super) host: usize,
}

/// Blocks and the lines between them.
#[derive(Debug, Default)]
pub(super) struct Graph<'a> {
    pub(super) blocks: Vec<Block<'a>>,
    pub(super) joins: Vec<Join>,
}

impl<'a> Block<'a> {
    fn new(content: Content<'a>) -> Self {
        Self { content, attached: Vec::new(), uncounted: Vec::new() }
    }

    /// Whether lines end here that come from elements.
    pub(super) fn is_host(&self) -> bool {
        matches!(self.content, Content::Shaft(_) | Content::Node(_))
    }

    fn name(&self) -> &'a str {
        match &self.content {
            Content::Shaft(part) | Content::Element(part) => &part.name,
            Content::Node(name) => name,
            Content::Folded(_) => "",
        }
    }

    /// Whether a source is attached here.
    pub(super) fn drives(&self) -> bool {
        let source =
            |part: &MechanismPart| matches!(part.symbol, Symbol::Motor | Symbol::Source | Symbol::CurrentSource);
        self.attached.iter().any(|part| source(part)) || matches!(self.content, Content::Element(part) if source(part))
    }
}

impl<'a> Graph<'a> {
    /// The graph of a mechanism, folded where it is large.
    pub(super) fn of(mechanism: &'a Mechanism) -> Self {
        let mut graph = Self::whole(mechanism);
        let hosts = graph.blocks.iter().filter(|block| block.is_host()).count();
        if hosts > HOSTS {
            graph = graph.fold_rows();
        }
        if graph.blocks.iter().filter(|block| block.is_host()).count() > HOSTS {
            graph = graph.near();
        }
        for block in &mut graph.blocks {
            if block.attached.len() > ATTACHED {
                block.uncounted =
                    block.attached.split_off(ATTACHED - 1).iter().map(|part| part.name.as_str()).collect();
            }
        }
        graph
    }

    fn whole(mechanism: &'a Mechanism) -> Self {
        let parts = &mechanism.parts;
        let mut graph = Self::default();
        let mut hosts: BTreeMap<(bool, &str), usize> = BTreeMap::new();
        for part in parts.iter().filter(|part| part.symbol.is_body()) {
            hosts.entry((false, &part.name)).or_insert(graph.blocks.len());
            graph.blocks.push(Block::new(Content::Shaft(part)));
        }
        for end in parts.iter().flat_map(|part| &part.terminals).filter(|end| end.kind == JoinKind::Node) {
            hosts.entry((true, &end.name)).or_insert_with(|| {
                graph.blocks.push(Block::new(Content::Node(&end.name)));
                graph.blocks.len() - 1
            });
        }
        let host = |end: &'a Terminal| match end.kind {
            JoinKind::Shaft => hosts.get(&(false, end.name.as_str())).copied(),
            JoinKind::Node => hosts.get(&(true, end.name.as_str())).copied(),
            _ => None,
        };
        let mut places: BTreeMap<&str, usize> = BTreeMap::new();
        for part in parts.iter().filter(|part| !part.symbol.is_body() && part.symbol != Symbol::Sensor) {
            let live: Vec<(usize, usize)> =
                part.terminals.iter().enumerate().filter_map(|(k, end)| Some((k, host(end)?))).collect();
            let place = match live[..] {
                [(_, host)] if part.terminals.len() <= 2 => {
                    graph.blocks[host].attached.push(part);
                    host
                }
                _ => {
                    let element = graph.blocks.len();
                    graph.blocks.push(Block::new(Content::Element(part)));
                    graph.joins.extend(live.iter().map(|&(end, host)| Join { element, end, host }));
                    element
                }
            };
            places.insert(&part.name, place);
        }
        for sensor in parts.iter().filter(|part| part.symbol == Symbol::Sensor) {
            let of_element = sensor.terminals.iter().filter(|end| end.kind == JoinKind::Element);
            let element = of_element.filter_map(|end| places.get(end.name.as_str()).copied()).next();
            match element.or_else(|| sensor.terminals.iter().find_map(host)) {
                Some(place) => graph.blocks[place].attached.push(sensor),
                None => graph.blocks.push(Block::new(Content::Element(sensor))),
            }
        }
        graph
    }

    /// Blocks by block: those that lines lead to, in the order of the lines.
    pub(super) fn neighbours(&self) -> Vec<Vec<usize>> {
        let mut out = vec![Vec::new(); self.blocks.len()];
        for &Join { element, host, .. } in &self.joins {
            out[element].push(host);
            out[host].push(element);
        }
        out
    }

    /// Parts that are connected, each with its blocks, in the order of their first blocks.
    pub(super) fn components(&self) -> Vec<Vec<usize>> {
        let neighbours = self.neighbours();
        let mut visited = vec![false; self.blocks.len()];
        let mut out = Vec::new();
        for start in 0..self.blocks.len() {
            if visited[start] {
                continue;
            }
            let found = reached(&neighbours, start);
            found.iter().for_each(|&(block, _)| visited[block] = true);
            out.push(found.into_iter().map(|(block, _)| block).collect());
        }
        out
    }

    /// How a block is built, without its names and numbers.
    fn build(&self, block: usize) -> String {
        let block = &self.blocks[block];
        let own = |part: &MechanismPart| format!("{:?} {}", part.symbol, part.laws.join(" "));
        let mut hung: Vec<String> = block.attached.iter().map(|part| own(part)).collect();
        hung.sort();
        match &block.content {
            Content::Shaft(part) | Content::Element(part) => format!("{} | {}", own(part), hung.join(", ")),
            Content::Node(_) => format!("node | {}", hung.join(", ")),
            Content::Folded(_) => "folded".into(),
        }
    }

    /// Long rows of equally built hosts keep two at each end.
    fn fold_rows(self) -> Self {
        let neighbours = self.neighbours();
        let next = |host: usize, element: usize| -> Option<usize> {
            let [a, b] = neighbours[element][..] else { return None };
            let neighbour = if a == host { b } else { a };
            (neighbour != host).then_some(neighbour)
        };
        let inner = |host: usize| match neighbours[host][..] {
            [a, b] => {
                self.blocks[host].is_host()
                    && self.build(a) == self.build(b)
                    && next(host, a).is_some()
                    && next(host, b).is_some()
                    && next(host, a) != next(host, b)
            }
            _ => false,
        };
        let identical = |a: usize, b: usize| self.build(a) == self.build(b);
        let mut dropped = BTreeSet::new();
        let mut visited = BTreeSet::new();
        for start in 0..self.blocks.len() {
            if !inner(start) || visited.contains(&start) {
                continue;
            }
            let follow_row = |first: usize| {
                let mut row = Vec::new();
                let (mut host, mut by) = (start, first);
                while let Some(neighbour) = next(host, by)
                    .filter(|&neighbour| inner(neighbour) && identical(start, neighbour) && neighbour != start)
                {
                    let far = neighbours[neighbour].iter().copied().find(|&element| element != by);
                    row.push(neighbour);
                    let Some(far) = far else { break };
                    (host, by) = (neighbour, far);
                }
                row
            };
            let before = follow_row(neighbours[start][0]);
            let ring =
                before.len() > 1 && before.last().is_some_and(|&last| neighbours[last].contains(&neighbours[start][1]));
            let after = if ring { Vec::new() } else { follow_row(neighbours[start][1]) };
            let row: Vec<usize> = before.into_iter().rev().chain([start]).chain(after).collect();
            visited.extend(row.iter().copied());
            if row.len() > ROW {
                dropped.extend(row[2..row.len() - 2].iter().copied());
            }
        }
        let retained = (0..self.blocks.len()).filter(|block| !dropped.contains(block)).collect();
        self.folded(&retained)
    }

    /// The hosts near the start: at most this number, and not too many side by side.
    fn near(self) -> Self {
        let neighbours = self.neighbours();
        let mut retained = BTreeSet::new();
        let mut hosts = 0;
        for component in self.components() {
            let mut hosts_at: BTreeMap<usize, usize> = BTreeMap::new();
            let found = reached_through(&neighbours, component[0], |block, distance| {
                let beside = hosts_at.entry(distance).or_default();
                let is_host = self.blocks[block].is_host();
                let has_room = !is_host || hosts < HOSTS && *beside < MOST_PARALLEL;
                if is_host && has_room {
                    *beside += 1;
                    hosts += 1;
                }
                has_room
            });
            retained.extend(found.into_iter().map(|(block, _)| block));
        }
        self.folded(&retained)
    }

    /// Only these hosts, and the elements between them; what is connected among the rest becomes one block.
    fn folded(self, retained: &BTreeSet<usize>) -> Self {
        let neighbours = self.neighbours();
        let host = |block: usize| self.blocks[block].is_host();
        let stays = |block: usize| match host(block) {
            true => retained.contains(&block),
            false if neighbours[block].is_empty() => retained.len() <= HOSTS || retained.contains(&block),
            false => neighbours[block].iter().all(|neighbour| retained.contains(neighbour)),
        };
        let stays: Vec<bool> = (0..self.blocks.len()).map(stays).collect();
        let mut group: Vec<Option<usize>> = vec![None; self.blocks.len()];
        // Parts joined to the same remaining hosts share a block, and so do parts joined to none.
        let mut of: BTreeMap<BTreeSet<usize>, usize> = BTreeMap::new();
        for start in 0..self.blocks.len() {
            if stays[start] || group[start].is_some() {
                continue;
            }
            let found = reached_through(&neighbours, start, |block, _| !stays[block]);
            let around = found.iter().flat_map(|&(block, _)| &neighbours[block]).copied();
            let bounds: BTreeSet<usize> = around.filter(|&block| stays[block]).collect();
            let next = of.len();
            let own = *of.entry(bounds).or_insert(next);
            found.into_iter().for_each(|(block, _)| group[block] = Some(own));
        }
        let groups = of.len();
        self.regrouped(&stays, &group, groups)
    }

    fn regrouped(self, stays: &[bool], group: &[Option<usize>], groups: usize) -> Self {
        let mut out = Self::default();
        let mut number = vec![0; self.blocks.len()];
        let mut folds: Vec<[Vec<&'a str>; 2]> = vec![Default::default(); groups];
        for (k, block) in self.blocks.into_iter().enumerate() {
            if stays[k] {
                number[k] = out.blocks.len();
                out.blocks.push(block);
            } else if let Some(of) = group[k] {
                let kind = usize::from(!block.is_host());
                match block.content {
                    Content::Folded([hosts, elements]) => {
                        folds[of][0].extend(hosts);
                        folds[of][1].extend(elements);
                    }
                    _ => folds[of][kind].push(block.name()),
                }
                folds[of][1].extend(block.attached.iter().map(|part| part.name.as_str()));
            }
        }
        let first = out.blocks.len();
        out.blocks.extend(folds.into_iter().map(|names| Block::new(Content::Folded(names))));
        let mut ends: BTreeSet<(usize, usize)> = BTreeSet::new();
        for Join { element, end, host } in self.joins {
            match (stays[element], stays[host], group[element]) {
                (true, true, _) => out.joins.push(Join { element: number[element], end, host: number[host] }),
                (false, true, Some(of)) if ends.insert((of, host)) => {
                    let end = ends.iter().filter(|(candidate, _)| *candidate == of).count() - 1;
                    out.joins.push(Join { element: first + of, end, host: number[host] });
                }
                _ => {}
            }
        }
        out
    }
}

/// The blocks reachable from a block, with the number of lines to each, nearest first.
pub(super) fn reached(neighbours: &[Vec<usize>], start: usize) -> Vec<(usize, usize)> {
    reached_through(neighbours, start, |_, _| true)
}

/// The same through blocks that may be entered, which is asked once for each, with its distance.
fn reached_through(
    neighbours: &[Vec<usize>],
    start: usize,
    mut enter: impl FnMut(usize, usize) -> bool,
) -> Vec<(usize, usize)> {
    let mut out: Vec<(usize, usize)> = enter(start, 0).then_some((start, 0)).into_iter().collect();
    let mut visited = BTreeSet::from([start]);
    let mut next = 0;
    while let Some(&(block, distance)) = out.get(next) {
        next += 1;
        for &neighbour in &neighbours[block] {
            if visited.insert(neighbour) && enter(neighbour, distance + 1) {
                out.push((neighbour, distance + 1));
            }
        }
    }
    out
}
