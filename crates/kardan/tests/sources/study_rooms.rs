//! The order of the rooms of `study`, read from the imports of its files.
//!
//! A room is a folder or a file of `src/study`. A file may name its own room and the rooms before it in [`STUDY`], nothing else; names
//! that `study/mod.rs` hands on count as those of the file that defines them. ARCHITECTURE.md states the same list.

use std::collections::BTreeSet;
use std::fs;

use crate::circles::dependences;
use crate::reader::{crate_folder, sources};

/// From what every room may name to what no other room names.
const STUDY: &[&str] = &[
    "progress",        // progress and interruption
    "read",            // tables of a file as typed values
    "measure",         // what is measured in a run
    "requests",        // what the tables of commands request
    "prepared",        // a variant ready to run, data only
    "check",           // what is wrong with a model
    "loops",           // laws, blocks and a plant
    "operating_point", // where a model is linearised
    "prepare",         // from a file to its variants
    "project",         // the entry point
    "analyze",
    "design",
    "run",
    "equations",
    "identification",
    "bench",
    "safety",
    "sweep",
];

/// The room of a file, relative to `src`; none of `study/mod.rs` and of files elsewhere.
fn room(file: &str) -> Option<&str> {
    let room = file.strip_prefix("study/")?.split('/').next()?.trim_end_matches(".rs");
    (room != "mod").then_some(room)
}

/// What dependences say against the order: `file → file (names)`.
fn breaches(dependences: &[(String, String, String)]) -> Vec<String> {
    let rank = |room: &str| STUDY.iter().position(|listed| *listed == room);
    let is_breach = |(from, to, _): &&(String, String, String)| {
        let (Some(own), Some(other)) = (room(from), room(to)) else { return false };
        own != other && rank(other) >= rank(own)
    };
    dependences.iter().filter(is_breach).map(|(from, to, names)| format!("{from} → {to} ({names})")).collect()
}

#[test]
fn a_file_of_study_names_only_its_own_room_and_those_before() {
    let src = crate_folder("src");
    let all = dependences(&src);
    let between =
        all.iter().filter(|(from, to, _)| room(from).is_some() && room(to).is_some() && room(from) != room(to));
    assert!(between.count() > 100, "too few imports between rooms were read");
    let wrong = breaches(&all);
    assert!(wrong.is_empty(), "rooms of `study` against their order:\n{}", wrong.join("\n"));
}

#[test]
fn every_room_of_study_is_listed() {
    let src = crate_folder("src");
    let files: Vec<String> = sources(&src.join("study"))
        .iter()
        .map(|file| file.strip_prefix(&src).expect("a file of the root").to_string_lossy().replace('\\', "/"))
        .collect();
    let found: BTreeSet<&str> = files.iter().filter_map(|file| room(file)).collect();
    assert_eq!(found, STUDY.iter().copied().collect::<BTreeSet<_>>());
}

#[test]
fn architecture_states_the_same_order() {
    let text = fs::read_to_string(crate_folder("../../ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    let (_, section) = text.split_once("### Rooms of `crates/kardan/src/study`").expect("a section of the rooms");
    let section = section.split("\n#").next().unwrap_or_default();
    let stated: Vec<&str> = section
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split('`').next())
        .map(|name| name.trim_end_matches('/').trim_end_matches(".rs"))
        .collect();
    assert_eq!(stated, STUDY);
}

#[test]
fn breaches_are_found() {
    let dependence = |from: &str, to: &str| (from.to_string(), to.to_string(), "Name".to_string());
    let good = [
        dependence("study/run/runs.rs", "study/prepared.rs"),
        dependence("study/loops/margins/check.rs", "study/loops/loop_blocks.rs"),
        dependence("study/mod.rs", "study/sweep/plan.rs"),
        dependence("study/read/faults.rs", "export/run.rs"),
    ];
    assert!(breaches(&good).is_empty());
    let bad = [
        dependence("study/prepared.rs", "study/check/effort.rs"),
        dependence("study/loops/margins/check.rs", "study/run/runs.rs"),
        dependence("study/run/runs.rs", "study/new_room/file.rs"),
    ];
    assert_eq!(breaches(&bad[..2]).len(), 2);
    assert_eq!(breaches(&bad[..2])[0], "study/prepared.rs → study/check/effort.rs (Name)");
    assert!(breaches(&bad[2..]).is_empty(), "the test of the list reports rooms that it lacks");
}
