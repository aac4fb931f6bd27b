//! Checks of the circuits of a model: nodes, ground, loops without resistance or inductance.

use crate::study::read::locations::{all_places, place_of_node};
use kardan_mechanics::equations::{Domain, GROUND, NamedTerm, Term};
use kardan_model::{Document, Model};
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted};
use std::collections::{BTreeMap, BTreeSet};

/// The charge through a branch and its other properties.
#[derive(Debug, Default)]
struct Branch<'m> {
    charge: &'m str,
    /// The nodes at its ends.
    ends: Vec<&'m str>,
    inductance: bool,
    /// Resistance or elastance: its voltage depends on its charge.
    passive: bool,
    /// A winding of a transformer, whose effect depends on the other one; or a current source.
    coupled: bool,
}

fn branches(model: &Model) -> Vec<Branch<'_>> {
    let mut out: BTreeMap<&str, Branch<'_>> = BTreeMap::new();
    for NamedTerm { term, .. } in &model.terms {
        if let Term::Coordinate { name, domain: Domain::Charge } = term {
            out.insert(name, Branch { charge: name, ..Branch::default() });
        }
    }
    for NamedTerm { term, .. } in &model.terms {
        if let Term::MultiplierLaw(row) = term {
            row.coordinates().into_iter().for_each(|name| out.entry(name).or_default().coupled = true);
        }
        let (Term::Inertia { direction, .. }
        | Term::Spring { direction, .. }
        | Term::Damper { direction, .. }
        | Term::Constraint { direction, .. }
        | Term::Balance { direction, .. }) = term
        else {
            continue;
        };
        for (charge, _) in &direction.entries {
            let Some(branch) = out.get_mut(charge.as_str()) else { continue };
            match term {
                Term::Balance { node, .. } => branch.ends.push(node),
                Term::Inertia { .. } => branch.inductance = true,
                Term::Constraint { .. } => branch.coupled = true,
                _ => branch.passive = true,
            }
        }
    }
    out.into_values().collect()
}

/// Adds branches one by one; each that closes a loop is left out and reported as a loop, the branch itself first.
fn loops<'m>(branches: impl Iterator<Item = &'m Branch<'m>>) -> Vec<Vec<&'m str>> {
    let mut forest: Vec<&Branch<'_>> = Vec::new();
    let mut out = Vec::new();
    for branch in branches {
        let [from, to] = branch.ends[..] else { continue };
        match path(&forest, from, to) {
            Some(way) => out.push(std::iter::once(branch.charge).chain(way).collect()),
            None => forest.push(branch),
        }
    }
    out
}

/// The branches of a forest between two of its nodes.
fn path<'m>(forest: &[&'m Branch<'m>], from: &str, to: &str) -> Option<Vec<&'m str>> {
    let mut open = vec![(from, Vec::new())];
    let mut visited = BTreeSet::from([from]);
    while let Some((node, way)) = open.pop() {
        if node == to {
            return Some(way);
        }
        for branch in forest.iter().filter(|branch| branch.ends.contains(&node)) {
            let next = branch.ends.iter().find(|end| **end != node);
            if let Some(next) = next.filter(|next| visited.insert(next)) {
                open.push((next, [way.clone(), vec![branch.charge]].concat()));
            }
        }
    }
    None
}

/// The label of a branch of a loop without inductance.
const NO_INDUCTANCE: &str = "no inductance";

/// Whether a diagnostic is that of [`massless_loop`].
pub(in crate::study) fn is_loop(diagnostic: &Diagnostic) -> bool {
    diagnostic.labels.iter().any(|label| label.text == NO_INDUCTANCE)
}

/// A loop of branches whose current could change without limit.
pub(in crate::study) fn massless_loop(document: &Document, branches: &[impl AsRef<str>]) -> Diagnostic {
    let mut names: Vec<&str> = branches.iter().map(AsRef::as_ref).collect();
    names.sort_unstable();
    Diagnostic::error("model::massless", format!("the loop through {} has no inductance", quoted(&names)))
        .at_each(all_places(document, names), NO_INDUCTANCE)
        .help("put an inductor into this loop; a real one has the inductance of its wires, some 1 uH per metre")
}

/// Reports errors that prevent a unique solution of the circuits of a model; false if there are any. Loops without inductance
/// go into `massless`.
pub(in crate::study) fn check_circuit(
    document: &Document,
    model: &Model,
    out: &mut Vec<Diagnostic>,
    massless: &mut Vec<Diagnostic>,
) -> bool {
    let branches = branches(model);
    let mut at_node: Nodes<'_> = BTreeMap::new();
    for branch in &branches {
        for node in &branch.ends {
            at_node.entry(node).or_default().push(branch);
        }
    }
    let before = out.len();
    check_node_names(document, &at_node, out);
    check_ground(document, &at_node, out);
    check_loops(document, &branches, out, massless);
    let fine = out.len() == before;
    check_open_ends(document, &at_node, out);
    fine
}

/// The branches that end at each node.
type Nodes<'m> = BTreeMap<&'m str, Vec<&'m Branch<'m>>>;

/// Reports nodes with the name of an element.
fn check_node_names(document: &Document, at_node: &Nodes<'_>, out: &mut Vec<Diagnostic>) {
    for node in at_node.keys() {
        let Some(element) = document.elements.get(node) else { continue };
        let message = format!("the name `{node}` is used twice, for {} and node", element.kind.keyword);
        out.push(
            Diagnostic::error("name::duplicate", message)
                .at(place_of_node(document, node), "as a node here")
                .at(&element.place, "first here")
                .help("give each element and each node a name of its own"),
        );
    }
}

/// Reports parts of the circuits that no branch connects with ground; a transformer does not connect them.
fn check_ground(document: &Document, at_node: &Nodes<'_>, out: &mut Vec<Diagnostic>) {
    let mut unvisited: BTreeSet<&str> = at_node.keys().copied().collect();
    let reached = |start: &str, unvisited: &mut BTreeSet<&str>| {
        let mut part: BTreeSet<String> = BTreeSet::new();
        let mut open = vec![start.to_string()];
        while let Some(node) = open.pop() {
            unvisited.remove(node.as_str());
            let ends = at_node.get(node.as_str()).into_iter().flatten().flat_map(|branch| &branch.ends);
            open.extend(ends.filter(|end| unvisited.contains(**end)).map(|end| end.to_string()));
            part.insert(node);
        }
        part
    };
    reached(GROUND, &mut unvisited);
    while let Some(node) = unvisited.first().copied() {
        let part = reached(node, &mut unvisited);
        let s = if part.len() == 1 { "" } else { "s" };
        let message = format!("nothing connects the node{s} {} with `{GROUND}`", quoted(&part));
        let help = format!(
            "let one branch of this part end at `{GROUND}` in place of one of its nodes: potentials count from there, and no \
             current flows through a single connection"
        );
        out.push(
            Diagnostic::error("circuit::floating", message).at_each(all_places(document, part), "floats").help(help),
        );
    }
}

/// Reports loops that determine no current; those that only lack an inductance go into `massless`.
fn check_loops(
    document: &Document,
    branches: &[Branch<'_>],
    out: &mut Vec<Diagnostic>,
    massless: &mut Vec<Diagnostic>,
) {
    let shorts = loops(branches.iter().filter(|b| !b.inductance && !b.coupled && !b.passive));
    for short in &shorts {
        let message = format!(
            "{} form a loop without inductance or resistance: their voltages contradict each other, or the current \
             between them is arbitrary",
            quoted(short)
        );
        let help = "remove one of them, or put the inductance and the resistance of the wires between them";
        let places = all_places(document, short);
        out.push(Diagnostic::error("circuit::short", message).at_each(places, "part of the loop").help(help));
    }
    if shorts.is_empty() {
        let slow = loops(branches.iter().filter(|b| !b.inductance && !b.coupled));
        massless.extend(slow.iter().map(|branches| massless_loop(document, branches)));
    }
}

/// Warns of nodes at which a single branch ends.
fn check_open_ends(document: &Document, at_node: &Nodes<'_>, out: &mut Vec<Diagnostic>) {
    for (node, branches) in at_node.iter().filter(|(node, _)| **node != GROUND) {
        let [only] = branches[..] else { continue };
        let help = match nearest(node, at_node.keys().copied().filter(|candidate| candidate != node)) {
            Some(near) => format!("did you mean `{near}`? Otherwise lead the current on to another node"),
            None => {
                format!("lead the current on to another node or to `{GROUND}`, or leave an open end if it is intended")
            }
        };
        let message =
            format!("no current can flow through `{}`: no other element ends at the node `{node}`", only.charge);
        let warning = Diagnostic::warning("circuit::open", message);
        out.push(warning.at(place_of_node(document, node), "an open end").help(help));
    }
}
