//! No circles between the files of a crate, also inside a folder.
//!
//! A file depends on another one where it names something that is defined there. Names are followed to the file of their
//! definition, so that a re-export is a name of the file behind it: `mod child;` and `pub use child::Name;` in a `mod.rs`
//! list what a folder has and are no dependence, and `use super::Name;` is one on the file that defines `Name`. What a
//! `mod.rs` defines itself is its own: if a child names it, the `mod.rs` may not name the child in its code.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::reader::{code, crates, sources};

/// Dependences that close circles and stand for now: crate, file or folder, what it depends on, why. The list may only shrink.
const ALLOWED: &[(&str, &str, &str, &str)] = &[];

/// One file of a crate as a module.
#[derive(Default)]
struct Module {
    /// Relative to `src`.
    file: String,
    path: Vec<String>,
    /// What is defined in the file itself.
    items: BTreeSet<String>,
    /// Names that an import binds, with the path behind each.
    bound: BTreeMap<String, Vec<Vec<String>>>,
    globs: Vec<Vec<String>>,
    /// Paths that the code names: imports that are not handed on, and `a::b` in expressions and types.
    named: Vec<Vec<String>>,
    /// Imports that are handed on, with the name that they get.
    handed_on: Vec<(String, Vec<String>)>,
    identifiers: BTreeSet<String>,
}

/// Where a path ends.
#[derive(Clone, Copy)]
enum End {
    Module(usize),
    Item(usize),
}

struct Crate {
    modules: Vec<Module>,
    by_path: BTreeMap<Vec<String>, usize>,
}

/// Words, `::` and single characters.
fn tokens(code: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut chars = code.chars().peekable();
    while let Some(c) = chars.next() {
        if c.is_alphanumeric() || c == '_' {
            let mut word = String::from(c);
            while let Some(next) = chars.next_if(|c| c.is_alphanumeric() || *c == '_') {
                word.push(next);
            }
            out.push(word);
        } else if c == ':' && chars.next_if_eq(&':').is_some() {
            out.push("::".into());
        } else if !c.is_whitespace() {
            out.push(c.into());
        }
    }
    out
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// The paths of an import, each with the name that it binds (`*` for all); `at` moves behind the tree.
fn import(tokens: &[String], at: &mut usize, stem: &[String], out: &mut Vec<(String, Vec<String>)>) {
    let mut path = stem.to_vec();
    while let Some(token) = tokens.get(*at) {
        *at += 1;
        match token.as_str() {
            "::" => {}
            "{" => {
                while tokens.get(*at).is_some_and(|token| token != "}") {
                    import(tokens, at, &path, out);
                    if tokens.get(*at).is_some_and(|token| token == ",") {
                        *at += 1;
                    }
                }
                *at += 1;
                return;
            }
            "*" => return out.push(("*".into(), path)),
            "as" => {
                let name = tokens.get(*at).cloned().unwrap_or_default();
                *at += 1;
                return out.push((name, path));
            }
            "self" if path.len() > stem.len() || !stem.is_empty() => {}
            word if is_word(word) => path.push(word.into()),
            _ => {
                *at -= 1;
                break;
            }
        }
    }
    if let Some(name) = path.last().cloned() {
        out.push((name, path));
    }
}

/// Whether the `use` at a place hands its names on: `pub use`, `pub(crate) use`.
fn is_public(tokens: &[String], at: usize) -> bool {
    let before = |k: usize| at.checked_sub(k).map_or("", |k| tokens[k].as_str());
    before(1) == "pub" || (before(1) == ")" && (before(4) == "pub" || before(5) == "pub" || before(6) == "pub"))
}

fn module(file: String, code: &str) -> Module {
    let mut path: Vec<String> = file.trim_end_matches(".rs").split('/').map(String::from).collect();
    if matches!(path.last().map(String::as_str), Some("mod" | "lib" | "main")) {
        path.pop();
    }
    let mut out = Module { file, path, ..Module::default() };
    let tokens = tokens(code);
    let (mut at, mut depth) = (0, 0);
    while at < tokens.len() {
        let token = tokens[at].as_str();
        at += 1;
        match token {
            "{" => depth += 1,
            "}" => depth -= 1,
            "use" if tokens.get(at).is_some_and(|next| is_word(next) || next == "{") => {
                let public = is_public(&tokens, at - 1);
                let mut found = Vec::new();
                import(&tokens, &mut at, &[], &mut found);
                for (name, path) in found {
                    if name == "*" {
                        out.globs.push(path);
                        continue;
                    }
                    if public {
                        out.handed_on.push((name.clone(), path.clone()));
                    } else {
                        out.named.push(path.clone());
                    }
                    out.bound.entry(name).or_default().push(path);
                }
            }
            // A lifetime.
            "static" if at > 1 && tokens[at - 2] == "'" => {}
            "fn" | "struct" | "enum" | "trait" | "type" | "const" | "static" | "mod" | "macro_rules" if depth == 0 => {
                let name = tokens[at..].iter().find(|token| is_word(token) && *token != "mut");
                if let Some(name) = name.filter(|_| !(token == "mod" && tokens.get(at + 1).is_some_and(|t| t == ";"))) {
                    out.items.insert(name.clone());
                }
            }
            word if is_word(word) && !(at > 1 && matches!(tokens[at - 2].as_str(), "::" | ".")) => {
                let (word, before) = (word.to_string(), at.checked_sub(2).map(|k| tokens[k].clone()));
                let mut path = vec![word.clone()];
                while tokens.get(at).is_some_and(|t| t == "::") && tokens.get(at + 1).is_some_and(|t| is_word(t)) {
                    path.push(tokens[at + 1].clone());
                    at += 2;
                }
                if path.len() > 1 {
                    out.named.push(path);
                }
                if before.as_deref() != Some("mod") {
                    out.identifiers.insert(word);
                }
            }
            _ => {}
        }
    }
    out
}

impl Crate {
    fn new(modules: Vec<Module>) -> Self {
        let by_path = modules.iter().enumerate().map(|(k, module)| (module.path.clone(), k)).collect();
        Self { modules, by_path }
    }

    fn child(&self, of: usize, name: &str) -> Option<usize> {
        let mut path = self.modules[of].path.clone();
        path.push(name.into());
        self.by_path.get(&path).copied()
    }

    /// A name in the scope of a module; `last` if nothing follows it in its path.
    fn find(&self, of: usize, name: &str, last: bool, steps: usize) -> Option<End> {
        let module = &self.modules[of];
        let child = self.child(of, name).map(End::Module);
        let item = module.items.contains(name).then_some(End::Item(of));
        let bound = || {
            let paths = module.bound.get(name)?;
            let ends: Vec<End> = paths.iter().filter_map(|path| self.end(of, path, steps)).collect();
            ends.iter().find(|end| matches!(end, End::Item(_)) == last).or(ends.first()).copied()
        };
        let glob = || {
            module.globs.iter().find_map(|path| match self.end(of, path, steps)? {
                End::Module(other) if other != of => self.find(other, name, last, steps.checked_sub(1)?),
                _ => None,
            })
        };
        if last { item.or_else(bound).or(child).or_else(glob) } else { child.or(item).or_else(bound).or_else(glob) }
    }

    /// Where a path leads from a module; nothing if out of the crate.
    fn end(&self, from: usize, path: &[String], steps: usize) -> Option<End> {
        let steps = steps.checked_sub(1)?;
        let mut place = from;
        for (k, name) in path.iter().enumerate() {
            let last = k + 1 == path.len();
            place = match name.as_str() {
                "crate" => *self.by_path.get(&Vec::new())?,
                "self" => place,
                "super" => {
                    let path = &self.modules[place].path;
                    *self.by_path.get(&path[..path.len().checked_sub(1)?])?
                }
                // An import's own first word is no name that this import binds.
                name => match self.find(place, name, last, steps)? {
                    End::Item(file) => return Some(End::Item(file)),
                    End::Module(next) => next,
                },
            };
        }
        Some(End::Module(place))
    }

    /// The files that each file depends on, with the names that say so.
    fn dependences(&self) -> Vec<BTreeMap<usize, BTreeSet<String>>> {
        let mut out = vec![BTreeMap::new(); self.modules.len()];
        for (k, module) in self.modules.iter().enumerate() {
            let handed =
                module.handed_on.iter().filter(|(name, _)| module.identifiers.contains(name)).map(|(_, path)| path);
            for path in module.named.iter().chain(handed) {
                if let Some(End::Item(other)) = self.end(k, path, 12)
                    && other != k
                {
                    let names: &mut BTreeSet<String> = out[k].entry(other).or_default();
                    names.insert(path.join("::"));
                }
            }
        }
        out
    }
}

/// The modules of a crate.
fn read(src: &Path) -> Crate {
    let mut modules = Vec::new();
    for file in sources(src) {
        let relative = file.strip_prefix(src).expect("a file of the root").to_string_lossy().replace('\\', "/");
        modules.push(module(relative, &code(&fs::read_to_string(&file).expect("a source"))));
    }
    Crate::new(modules)
}

/// Every dependence of a file of a crate on another one: both files, and the names that say so.
pub fn dependences(src: &Path) -> Vec<(String, String, String)> {
    let all = read(src);
    let file = |k: usize| all.modules[k].file.clone();
    let mut out = Vec::new();
    for (k, next) in all.dependences().iter().enumerate() {
        for (other, names) in next {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            out.push((file(k), file(*other), names.join(", ")));
        }
    }
    out
}

/// The places that can be reached from each.
fn reachable(next: &[BTreeMap<usize, BTreeSet<String>>]) -> Vec<BTreeSet<usize>> {
    (0..next.len())
        .map(|start| {
            let (mut visited, mut open) = (BTreeSet::new(), vec![start]);
            while let Some(at) = open.pop() {
                open.extend(next[at].keys().filter(|k| visited.insert(**k)));
            }
            visited
        })
        .collect()
}

/// Every dependence that lies on a circle: `file → file (names)`.
fn circles(dependences: &[BTreeMap<usize, BTreeSet<String>>]) -> Vec<(usize, usize)> {
    let reach = reachable(dependences);
    let mut out = Vec::new();
    for (k, next) in dependences.iter().enumerate() {
        out.extend(next.keys().filter(|other| reach[**other].contains(&k)).map(|other| (k, *other)));
    }
    out
}

/// Whether a file is that of an entry of the list, or in its folder.
fn is_of(file: &str, entry: &str) -> bool {
    file == entry || entry.ends_with('/') && file.starts_with(entry)
}

#[test]
fn files_of_a_crate_have_no_circles() {
    let mut wrong = Vec::new();
    for (name, src) in crates() {
        let all = read(&src);
        let mut dependences = all.dependences();
        let file = |k: usize| all.modules[k].file.as_str();
        let on_circles = circles(&dependences);
        for (_, from, to, _) in ALLOWED.iter().filter(|entry| entry.0 == name) {
            let covered = on_circles.iter().filter(|(k, other)| is_of(file(*k), from) && is_of(file(*other), to));
            if covered.clone().next().is_none() {
                wrong.push(format!("{name}: {from} → {to} closes no circle: take it out of the list"));
            }
            covered.for_each(|(k, other)| drop(dependences[*k].remove(other)));
        }
        for (k, other) in circles(&dependences) {
            let names: Vec<&str> = dependences[k][&other].iter().map(String::as_str).collect();
            wrong.push(format!("{name}: {} → {} ({})", file(k), file(other), names.join(", ")));
        }
    }
    assert!(wrong.is_empty(), "dependences on circles:\n{}", wrong.join("\n"));
}

#[test]
fn names_are_followed_to_the_file_that_defines_them() {
    let sources = [
        ("lib.rs", "pub mod a; pub mod b;"),
        ("a/mod.rs", "mod one; mod two; pub use one::One; pub use two::*; pub use one::Unused as Renamed; fn own() {}"),
        ("a/one.rs", "use super::{Two, two::{self, Other}}; pub struct One(Two); fn f() { two::g(); super::own() }"),
        ("a/two.rs", "pub struct Two; pub enum Other { X } pub fn g() { let a = 1; a.own(); }"),
        ("b.rs", "use crate::a::{self, Renamed as R}; const X: a::One = crate::a::Two; fn h(x: std::a::One) {}"),
    ];
    let all = Crate::new(sources.map(|(file, code)| module(file.into(), code)).into());
    let file = |k: usize| all.modules[k].file.clone();
    let found: Vec<(String, Vec<String>)> = all
        .dependences()
        .iter()
        .enumerate()
        .map(|(k, next)| (file(k), next.keys().map(|other| file(*other)).collect()))
        .filter(|(_, next): &(String, Vec<String>)| !next.is_empty())
        .collect();
    let expected = [("a/one.rs", vec!["a/mod.rs", "a/two.rs"]), ("b.rs", vec!["a/one.rs", "a/two.rs"])];
    assert_eq!(found, expected.map(|(file, next)| (file.to_string(), next.iter().map(ToString::to_string).collect())));
    assert!(circles(&all.dependences()).is_empty());
    // A folder that uses in its own code what its files give closes a circle with those that use what it defines.
    let own = "mod one; pub use one::One; fn own() -> One { one::make() }";
    let closed = [("lib.rs", "mod a;"), ("a/mod.rs", own), ("a/one.rs", "pub struct One; fn make() { super::own() }")];
    let all = Crate::new(closed.map(|(file, code)| module(file.into(), code)).into());
    assert_eq!(circles(&all.dependences()), [(1, 2), (2, 1)]);
}
