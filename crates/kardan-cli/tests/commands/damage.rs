//! Rows, manifests and job lists that were damaged at random: a sweep that goes on, and a merge, refuse them by name or come to the same answers.
//!
//! `KARDAN_MODELS` asks for more damages of each kind of file, `1000`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use kardan::num::Random;

use super::sweep::MODEL;

fn kardan(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null()).output().unwrap()
}

/// A number below another one.
fn below(random: &mut Random, end: usize) -> usize {
    random.below(end.max(1) as u64) as usize
}

/// Damages bytes in one of many ways, in words.
fn damaged(bytes: &[u8], other: &[u8], random: &mut Random) -> (Option<Vec<u8>>, String) {
    let mut out = bytes.to_vec();
    let at = below(random, out.len());
    let length = 1 + below(random, 40);
    let end = (at + length).min(out.len());
    let what = match below(random, 10) {
        0 | 1 => {
            out[at] ^= 1 << below(random, 8);
            format!("a bit of byte {at} is flipped")
        }
        2 => {
            out[at..end].iter_mut().for_each(|byte| *byte = random.next_u64() as u8);
            format!("bytes {at} to {end} are random")
        }
        3 => {
            out.truncate(at);
            format!("{at} bytes are left")
        }
        4 => {
            out.extend((0..length).map(|_| random.next_u64() as u8));
            format!("{length} bytes more")
        }
        5 => {
            out.drain(at..end);
            format!("bytes {at} to {end} are cut out")
        }
        6 => {
            let digits: Vec<usize> = (0..out.len()).filter(|k| out[*k].is_ascii_digit()).collect();
            digits.get(below(random, digits.len())).inspect(|k| out[**k] = b'9');
            "a digit is 9".into()
        }
        7 => {
            out = other.to_vec();
            "it is another file".into()
        }
        8 => {
            out[at..end].fill(0);
            format!("bytes {at} to {end} are zero")
        }
        _ => return (None, "it is gone".into()),
    };
    (Some(out), what)
}

/// A sweep in three shards, as it was left: its files.
struct Swept {
    at: PathBuf,
    results: Vec<u8>,
    files: Vec<(PathBuf, Vec<u8>)>,
}

const SWEEP: [&str; 11] =
    ["sweep", "m.toml", "--samples", "190", "--on", "local", "--shards", "3", "--out", "o", "--quiet"];

impl Swept {
    fn new(name: &str) -> Self {
        let at = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("damage_{name}"));
        let _ = fs::remove_dir_all(&at);
        fs::create_dir_all(&at).unwrap();
        fs::write(at.join("m.toml"), MODEL).unwrap();
        assert_eq!(kardan(&at, &SWEEP).status.code(), Some(1));
        let mut files = Vec::new();
        let mut folders = vec![at.join("o")];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap().flatten() {
                match entry.path() {
                    path if path.is_dir() => folders.push(path),
                    path => files.push((path.clone(), fs::read(path).unwrap())),
                }
            }
        }
        files.sort();
        let results = fs::read(at.join("o/sweep.json")).unwrap();
        Self { at, results, files }
    }

    fn restore(&self) {
        let _ = fs::remove_dir_all(self.at.join("o"));
        for (path, bytes) in &self.files {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
        // Answers are those of the next command.
        fs::remove_file(self.at.join("o/sweep.json")).unwrap();
    }

    /// Files whose names begin so.
    fn of(&self, start: &str) -> Vec<&(PathBuf, Vec<u8>)> {
        let is = |path: &Path| path.file_name().unwrap().to_str().unwrap().starts_with(start);
        self.files.iter().filter(|(path, _)| is(path)).collect()
    }

    /// Whether what came of it is right: refused with the name of a file, or the same answers.
    fn is_refused_or_the_same(&self, got: &Output, name: &str, what: &str) -> bool {
        let error: String = String::from_utf8_lossy(&got.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        let refused = error.replace("│ ", "").replace(' ', "").contains(&name.replace(' ', ""));
        let same = fs::read(self.at.join("o/sweep.json")).is_ok_and(|results| results == self.results);
        match got.status.code() {
            Some(1) => assert!(same, "{name}, {what}: other answers"),
            Some(2) => assert!(refused && !error.contains("panic"), "{name}, {what}: {error}"),
            other => panic!("{name}, {what}: it ends with {other:?}: {error}"),
        }
        got.status.code() == Some(2)
    }
}

/// Files of each kind, damaged: the same command with `--resume`, and a merge of the parts.
#[test]
fn random_damage_is_refused_or_repaired() {
    let count: u64 = std::env::var("KARDAN_MODELS").ok().and_then(|count| count.parse().ok()).unwrap_or(12);
    let swept = Swept::new("random");
    let resume = [&SWEEP[..], &["--resume"]].concat();
    let merge = ["sweep", "merge", "m.toml", "o/parts/1", "o/parts/2", "o/parts/3", "--out", "o", "--quiet"];
    let mut refused = [[0; 2]; 3];
    for (kind, start) in ["rows-", "shard-", "jobs.txt"].into_iter().enumerate() {
        let files = swept.of(start);
        for seed in 0..count {
            let mut random = Random::named(seed, start);
            let (path, bytes) = files[below(&mut random, files.len())];
            let (_, other) = &swept.files[below(&mut random, swept.files.len())];
            let (new, what) = damaged(bytes, other, &mut random);
            let name = path.file_name().unwrap().to_str().unwrap();
            let what = format!("seed {seed}: {what}");
            for (turn, command) in [&resume[..], &merge].into_iter().enumerate() {
                swept.restore();
                match &new {
                    Some(bytes) => fs::write(path, bytes).unwrap(),
                    None => fs::remove_file(path).unwrap(),
                }
                // A merge of what is not all there says which rows are missing.
                let is_missing = turn == 1 && kind == 0 && new.is_none();
                let name = if is_missing { "" } else { name };
                let got = kardan(&swept.at, command);
                refused[kind][turn] += u64::from(swept.is_refused_or_the_same(&got, name, &what));
            }
        }
    }
    println!("refused of {count} rows, manifests, job lists, by `--resume` and by `merge`: {refused:?}");
    // `--resume` repairs rows and manifests, whatever has become of them.
    assert_eq!((refused[0][0], refused[1]), (0, [0, 0]), "{refused:?}");
    assert!(refused[0][1] > count / 2 && refused[2][0] > count / 2 && refused[2][1] == 0, "{refused:?}");
}

/// Whatever is gone, with or without its manifest, `--resume` makes it again.
#[test]
fn what_is_gone_is_made_again() {
    let swept = Swept::new("gone");
    let resume = [&SWEEP[..], &["--resume"]].concat();
    let gone: [&[&str]; 7] = [
        &["parts/2/shard-2-of-3.json"],
        &["parts/2/rows-000001.parquet"],
        &["parts/2/rows-000001.parquet", "parts/2/shard-2-of-3.json"],
        &["parts/2"],
        &["parts/1/rows-000000.parquet", "parts/2", "jobs.txt"],
        &["parts", "logs"],
        &["jobs.txt", "shard.sh", "job.sh", "logs"],
    ];
    for names in gone {
        swept.restore();
        for path in names.iter().map(|name| swept.at.join("o").join(name)) {
            if path.is_dir() { fs::remove_dir_all(path).unwrap() } else { fs::remove_file(path).unwrap() }
        }
        let got = kardan(&swept.at, &resume);
        assert_eq!(got.status.code(), Some(1), "{names:?}: {}", String::from_utf8_lossy(&got.stderr));
        assert!(fs::read(swept.at.join("o/sweep.json")).unwrap() == swept.results, "{names:?}");
    }
}
