//! Files as careful users treat them: links, modes, inputs, full disks, runs that are killed. Nothing that was whole is lost, and
//! nothing that is not whole is taken for a result.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const MODEL: &str = "[model]\nname = \"axle\"\n[shaft.axle]\ninertia = \"0.01 kg m^2\" # from the drawing\n\
                     damping = \"0.1 N m s/rad\"\nfriction = \"0.1 N m\"\n[motor.drive]\nshaft = \"axle\"\n\
                     [scenario]\nduration = \"0.2 s\"\noutput_step = \"10 ms\"\n\
                     [[scenario.event]]\nsignal = \"drive.tau\"\nat = \"50 ms\"\nto = \"1 N m\"\n\
                     [bench]\nspeed_limit = { axle = \"60 rad/s\" }\npoints = 3\ndwell = \"0.05 s\"\n";

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null()).env_remove("KARDAN_FAULT");
    command
}

fn kardan(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// A fault of it, and an effect with a bound that it keeps.
const FAULTS: &str = "[fault.dead]\nmotor = \"drive\"\nat = \"0.01 s\"\n[safety]\n[[safety.effect]]\nname = \"turn\"\n\
                      signal = \"axle.phi\"\nbelow = \"100 rad\"\n";
/// With a controller for a study on the bench.
const STUDY: &str = "[control.hold]\nlaw = \"position_loop\"\ninput = \"drive\"\noutput = \"axle.phi\"\nreference = \"wish\"\n\
                     sample_time = \"5 ms\"\n";

/// Miette's frame and line breaks taken out.
fn plain_text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes)
        .replace(['│', '×', '╰', '─', '▶'], " ")
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}

/// 0.02 N m s/rad and 0.3 N m, with what a clock knows as noise.
fn log(rows: u32) -> String {
    let mut log = String::from("time,axle.w,drive.tau\ns,rad/s,N m\n");
    for k in 0..rows {
        let speed = [5.0, 12.0, -4.0, -15.0, 20.0, -9.0, 7.0, -20.0][(k / 200) as usize % 8];
        let hiss = f64::from(k * 7919 % 1009) / 1009.0 - 0.5;
        let torque = 0.02 * speed + 0.3_f64.copysign(speed) + 0.05 * hiss;
        let _ = writeln!(log, "{:.3},{speed},{torque:.6}", 0.001 * f64::from(k));
    }
    log
}

fn study() -> String {
    MODEL
        .replace("[scenario]", &format!("{STUDY}[scenario]"))
        .replace("\"drive.tau\"", "\"wish\"")
        .replace("\"1 N m\"", "\"0.1 rad\"")
}

/// A fresh folder with a model, one with a controller, and a log.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("files").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    fs::write(path.join("axle.toml"), MODEL).unwrap();
    fs::write(path.join("faults.toml"), MODEL.to_owned() + FAULTS).unwrap();
    let swept = MODEL.replacen("\"0.1 N m s/rad\"", "\"0.1 N m s/rad ± 10 %\"", 1);
    fs::write(path.join("swept.toml"), swept).unwrap();
    fs::write(path.join("study.toml"), study()).unwrap();
    fs::write(path.join("bench.csv"), log(1600)).unwrap();
    path
}

/// Every plain file below a folder with its content.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut out = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            out.extend(contents(&path));
        } else {
            let bytes = fs::read(&path).unwrap_or_default(); // a link may lead nowhere
            out.insert(path, bytes);
        }
    }
    out
}

fn is_part(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "part")
}

/// Refused with these words, and nothing is changed.
fn refused(at: &Path, arguments: &[&str], parts: &[&str]) {
    let before = contents(at);
    let got = kardan(at, arguments);
    let stderr = plain_text(&got.stderr);
    assert_eq!(got.status.code(), Some(2), "{arguments:?}: {stderr}");
    for part in parts {
        assert!(stderr.contains(part), "{arguments:?} does not say {part}: {stderr}");
    }
    assert_eq!(contents(at), before, "{arguments:?}");
}

const FIT: [&str; 3] = ["identify", "axle.toml", "bench.csv"];

fn fit<'a>(more: &[&'a str]) -> Vec<&'a str> {
    FIT.iter().copied().chain(more.iter().copied()).collect()
}

#[test]
fn what_a_command_reads_is_not_written_over() {
    let at = folder("inputs");
    fs::write(at.join("truth.toml"), "").unwrap();
    for (option, path) in
        [("--report", "bench.csv"), ("--write", "bench.csv"), ("--report", "axle.toml"), ("--write", "./bench.csv")]
    {
        refused(&at, &fit(&[option, path]), &["file::input", "reads it", "nothing was computed"]);
    }
    refused(&at, &["design", "axle.toml", "--outputs", "axle.phi", "--controller", "axle.toml"], &["file::input"]);
    refused(
        &at,
        &["design", "axle.toml", "--outputs", "axle.phi", "--report", "../inputs/axle.toml"],
        &["file::input"],
    );
    refused(&at, &["analyze", "axle.toml", "--report", "axle.toml"], &["file::input"]);
    refused(&at, &fit(&["--report", "new", "--write", "./new"]), &["file::same"]);
    // A model that stands where a table of a run would go.
    fs::write(at.join("report.html"), MODEL).unwrap();
    let got = kardan(&at, &["run", "report.html", "--out", "."]);
    assert_eq!((got.status.code(), plain_text(&got.stderr).contains("file::input")), (Some(2), true));
    assert_eq!(fs::read_to_string(at.join("report.html")).unwrap(), MODEL);
    // The model itself is what `--write` may replace.
    let got = kardan(&at, &fit(&["--write", "axle.toml"]));
    assert_eq!(got.status.code(), Some(0), "{}", plain_text(&got.stderr));
    assert!(fs::read_to_string(at.join("axle.toml")).unwrap().contains("# from the drawing"));
    assert_ne!(fs::read_to_string(at.join("axle.toml")).unwrap(), MODEL);
}

#[test]
fn what_is_no_file_is_reported_clearly() {
    let at = folder("odd");
    fs::create_dir(at.join("folder")).unwrap();
    for (path, part) in [
        ("folder", "is not the name of a file"),
        ("-", "/dev/stdout"),
        ("axle.toml/x", "axle.toml"),
        (".", "name of a file"),
    ] {
        refused(&at, &["analyze", "axle.toml", "--report", path], &[part]);
    }
    let got = kardan(&at, &["models", "two-bodies", "--write", "folder/new.toml"]);
    assert_eq!(got.status.code(), Some(0));
    refused(&at, &["models", "two-bodies", "--write", "nowhere/new.toml"], &["no such file or directory"]);
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

    use super::*;

    #[test]
    fn links_are_followed_and_modes_preserved() {
        let at = folder("links");
        fs::create_dir(at.join("real")).unwrap();
        fs::rename(at.join("axle.toml"), at.join("real/axle.toml")).unwrap();
        symlink("real/axle.toml", at.join("axle.toml")).unwrap();
        for mode in [0o600, 0o640, 0o664] {
            fs::set_permissions(at.join("real/axle.toml"), fs::Permissions::from_mode(mode)).unwrap();
            let got = kardan(&at, &fit(&["--write", "axle.toml"]));
            assert_eq!(got.status.code(), Some(0), "{}", plain_text(&got.stderr));
            assert!(at.join("axle.toml").is_symlink());
            let metadata = fs::metadata(at.join("real/axle.toml")).unwrap();
            assert_eq!((metadata.mode() & 0o7777, metadata.is_file()), (mode, true));
            assert!(fs::read_to_string(at.join("real/axle.toml")).unwrap().contains("95 %"));
        }
        // A link to a file that is not there yet makes that file.
        symlink("real/fit.html", at.join("fit.html")).unwrap();
        assert_eq!(kardan(&at, &fit(&["--report", "fit.html"])).status.code(), Some(0));
        assert!(at.join("fit.html").is_symlink() && at.join("real/fit.html").is_file());
        // New files follow the mask of the user.
        let mut masked = Command::new("sh");
        masked
            .current_dir(&at)
            .arg("-c")
            .arg(format!("umask 077; exec {} -q analyze axle.toml --report new.html", env!("CARGO_BIN_EXE_kardan")));
        assert_eq!(masked.output().unwrap().status.code(), Some(0));
        assert_eq!(fs::metadata(at.join("new.html")).unwrap().mode() & 0o777, 0o600);
        symlink("b", at.join("a")).unwrap();
        symlink("a", at.join("b")).unwrap();
        refused(&at, &["analyze", "axle.toml", "--report", "a"], &["symbolic links"]);
    }

    /// Where a command chooses the names, in a folder that was named, no link out of that folder is followed: what it leads to stays as it is.
    #[test]
    fn links_out_of_an_output_folder_are_not_followed() {
        let at = folder("outside");
        let swept = MODEL.replace("0.01 kg m^2", "0.01 kg m^2 ± 10 %")
            + "[[requirement]]\nsignal = \"axle.w\"\nmeasure = \"max\"\nbelow = \"1e3 rad/s\"\n";
        fs::write(at.join("swept.toml"), swept).unwrap();
        let commands: [&[&str]; 5] = [
            &["run", "axle.toml", "--out", "o"],
            &["bench", "axle.toml", "--out", "o"],
            &["sweep", "swept.toml", "--samples", "70", "--out", "o", "--resume"],
            &["sweep", "swept.toml", "--samples", "70", "--shard", "1/2", "--out", "o", "--resume"],
            &[
                "sweep",
                "swept.toml",
                "--samples",
                "70",
                "--on",
                "local",
                "--shards",
                "2",
                "--retries",
                "0",
                "--out",
                "o",
                "--resume",
            ],
        ];
        let victim = at.join("victim");
        for arguments in commands {
            let _ = fs::remove_dir_all(at.join("o"));
            assert_eq!(kardan(&at, arguments).status.code(), Some(0), "{arguments:?}");
            let mut reported = 0;
            for (path, whole) in contents(&at.join("o")) {
                fs::write(&victim, "mine").unwrap();
                // A shard whose rows were refused has no manifest any more.
                let _ = fs::remove_file(&path);
                symlink(&victim, &path).unwrap();
                let got = kardan(&at, arguments);
                let stderr = plain_text(&got.stderr);
                assert_eq!(fs::read(&victim).unwrap(), b"mine", "{arguments:?}: {}", path.display());
                if got.status.code() == Some(2) {
                    let other = path.ends_with("jobs.txt") && stderr.contains("kardan cannot resume");
                    assert!(
                        other || stderr.contains("is a symbolic link to"),
                        "{arguments:?}: {}: {stderr}",
                        path.display()
                    );
                    reported += 1;
                } else {
                    // What was of no use any more went away, or was not written.
                    assert_eq!(got.status.code(), Some(0), "{}: {stderr}", path.display());
                }
                let _ = fs::remove_file(&path);
                fs::write(&path, whole).unwrap();
            }
            assert!(reported > 2, "{arguments:?}: {reported}");
        }
        // Folders too, and a link that leads nowhere yet; one that stays in the folder, and the folder itself, are followed.
        fs::remove_dir_all(at.join("o/parts")).unwrap();
        fs::create_dir(at.join("elsewhere")).unwrap();
        symlink("../elsewhere", at.join("o/parts")).unwrap();
        refused(&at, commands[4], &["file::link", "o/parts"]);
        assert_eq!(fs::read_dir(at.join("elsewhere")).unwrap().count(), 0);
        fs::remove_dir_all(at.join("o")).unwrap();
        fs::create_dir(at.join("o")).unwrap();
        symlink("../new", at.join("o/report.html")).unwrap();
        let got = kardan(&at, commands[0]);
        assert!(
            got.status.code() == Some(2)
                && plain_text(&got.stderr).contains("`o/report.html` is not written: it is a symbolic link")
        );
        assert!(!at.join("new").exists() && at.join("o/axle.csv").is_file());
        fs::remove_file(at.join("o/report.html")).unwrap();
        symlink("inside", at.join("o/report.html")).unwrap();
        symlink("o", at.join("named")).unwrap();
        assert_eq!(kardan(&at, &["run", "axle.toml", "--out", "named"]).status.code(), Some(0));
        assert!(at.join("o/inside").is_file() && at.join("o/report.html").is_symlink());
    }

    /// Nobody reads at the other end of a pipe: a file of a name that kardan chose is not written to one.
    #[test]
    fn pipes_in_an_output_folder_are_refused() {
        let swept = MODEL.replace("0.01 kg m^2", "0.01 kg m^2 ± 10 %")
            + "[[requirement]]\nsignal = \"axle.w\"\nmeasure = \"max\"\nbelow = \"1e3 rad/s\"\n";
        let local = ["--on", "local", "--shards", "2", "--retries", "0"];
        let run = ["run", "axle.toml", "--out", "o"];
        let sweep = ["sweep", "swept.toml", "--samples", "70", "--out", "o", "--resume"];
        for (name, arguments) in [
            ("report.html", run.to_vec()),
            ("axle.csv", run.to_vec()),
            ("rows-000000.parquet", sweep.to_vec()),
            ("jobs.txt", [&sweep[..], &local].concat()),
        ] {
            let at = folder("pipes");
            fs::write(at.join("swept.toml"), &swept).unwrap();
            fs::create_dir(at.join("o")).unwrap();
            if !Command::new("mkfifo").arg(at.join("o").join(name)).status().is_ok_and(|made| made.success()) {
                return;
            }
            let got = kardan(&at, &arguments);
            let stderr = plain_text(&got.stderr);
            assert!(got.status.code() == Some(2) && stderr.contains("pipe"), "{name}: {:?} {stderr}", got.status);
        }
    }

    #[test]
    fn files_that_cannot_be_replaced_as_they_are_stay() {
        let at = folder("kept");
        fs::write(at.join("old.html"), "old").unwrap();
        fs::set_permissions(at.join("old.html"), fs::Permissions::from_mode(0o444)).unwrap();
        refused(&at, &fit(&["--report", "old.html"]), &["file::read-only", "nothing was computed"]);
        fs::set_permissions(at.join("old.html"), fs::Permissions::from_mode(0o644)).unwrap();
        fs::hard_link(at.join("old.html"), at.join("other.html")).unwrap();
        refused(&at, &fit(&["--report", "old.html"]), &["file::hard-links", "2 names"]);
        // Another name of the log is the log.
        fs::hard_link(at.join("bench.csv"), at.join("name.csv")).unwrap();
        refused(&at, &fit(&["--report", "name.csv"]), &["file::input"]);
        symlink("bench.csv", at.join("link.csv")).unwrap();
        refused(&at, &fit(&["--report", "link.csv"]), &["file::input"]);
    }

    #[test]
    fn streams_and_devices_are_written_to() {
        let at = folder("streams");
        let got = kardan(&at, &["-q", "analyze", "axle.toml", "--report", "/dev/stdout"]);
        let text = String::from_utf8(got.stdout).unwrap();
        assert!(text.contains("<!doctype html>") && text.contains("axle"), "{text}");
        // Where standard output is a file, page and text follow each other.
        let file = fs::File::create(at.join("both")).unwrap();
        let status =
            command(&at, &["-q", "analyze", "axle.toml", "--report", "/dev/stdout"]).stdout(file).status().unwrap();
        assert_eq!((status.code(), fs::read_to_string(at.join("both")).unwrap()), (Some(0), text));
        assert_eq!(kardan(&at, &["analyze", "axle.toml", "--report", "/dev/null"]).status.code(), Some(0));
        if Path::new("/dev/full").exists() {
            refused(&at, &["analyze", "axle.toml", "--report", "/dev/full"], &["no space left"]);
        }
        let pipe = Command::new("mkfifo").arg(at.join("pipe")).status();
        if pipe.is_ok_and(|status| status.success()) {
            let reader = std::thread::spawn({
                let pipe = at.join("pipe");
                move || fs::read_to_string(pipe).unwrap()
            });
            assert_eq!(kardan(&at, &["analyze", "axle.toml", "--report", "pipe"]).status.code(), Some(0));
            assert!(reader.join().unwrap().contains("<!doctype html>"));
            // Without a reader it waits, but not for ever.
            let got = kardan(&at, &["analyze", "axle.toml", "--report", "pipe"]);
            let stderr = plain_text(&got.stderr);
            assert!(got.status.code() == Some(2) && stderr.contains("nobody reads this pipe"), "{stderr}");
        }
    }

    /// A disk of 256 KiB of its own, full but for a few: what a command wrote before stays, what it could not write it names, and
    /// nothing is cut short. Needs a mount of its own (root, or user namespaces); where that is refused the test says so on the
    /// terminal, and limits of the size of files (below) stand for it.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_disk_that_is_really_full_takes_nothing_away() {
        let at = folder("tmpfs");
        fs::create_dir(at.join("disk")).unwrap();
        let mounted = |options: &str, script: &str| {
            let script = format!("mount -t tmpfs -o size=256k none disk && {script}");
            let mut shell = Command::new("unshare");
            shell.current_dir(&at).arg(options).args(["sh", "-c", &script]).stdin(Stdio::null());
            shell.output()
        };
        let works = |options: &&str| mounted(options, "true").is_ok_and(|out| out.status.success());
        let Some(options) = ["-m", "-Urm"].into_iter().find(|options| works(options)) else {
            use std::io::Write;
            let _ = writeln!(
                std::io::stderr(),
                "NOT TRIED: a_disk_that_is_really_full_takes_nothing_away (neither `unshare -m` nor `unshare -Urm` may mount a tmpfs)"
            );
            return;
        };
        for (line, result, room) in [
            ("run axle.toml --out disk", "report.html", 0),
            // Tables have room, the report has not.
            ("run axle.toml --out disk", "report.html", 24 << 10),
            ("bench study.toml --study --out disk", "report.html", 0),
            ("bench study.toml --study --out disk", "report.html", 120 << 10),
            ("identify disk/axle.toml bench.csv --write disk/axle.toml", "axle.toml", 0),
            ("analyze axle.toml --report disk/page.html", "page.html", 0),
            ("design axle.toml --outputs axle.phi --no-simulation --report disk/page.html", "page.html", 0),
            ("models two-bodies --write disk/new.toml", "", 0),
        ] {
            let kardan = env!("CARGO_BIN_EXE_kardan");
            let script = format!(
                "cp axle.toml disk/; [ -z '{result}' -o -e disk/'{result}' ] || echo 'old and whole' > disk/{result}; \
                 cp -r disk before; head -c 1000000 /dev/zero > disk/filler 2>/dev/null; \
                 truncate -s -{room} disk/filler; {kardan} {line}; echo \"code $?\"; \
                 rm disk/filler; ls -A disk; rm -rf after; cp -r disk after"
            );
            let out = mounted(options, &script).unwrap();
            let (text, stderr) = (String::from_utf8_lossy(&out.stdout), plain_text(&out.stderr));
            assert!(text.contains("code 2"), "{line}: {text} {stderr}");
            assert!(stderr.contains("no space left"), "{line}: {stderr}");
            assert!(!contents(&at.join("after")).keys().any(|path| is_part(path)), "{line}: {text}");
            assert_eq!(text.contains(".csv"), room > 0, "{line}: {text}");
            for (path, bytes) in contents(&at.join("before")) {
                let now = at.join("after").join(path.strip_prefix(at.join("before")).unwrap());
                assert!(fs::read(&now).unwrap() == bytes, "{line}: {}", now.display());
            }
            fs::remove_dir_all(at.join("before")).unwrap();
            fs::remove_dir_all(at.join("after")).unwrap();
        }
    }

    /// A disk on which only files of a kibibyte have room.
    #[test]
    fn a_full_disk_takes_nothing_away() {
        let at = folder("full");
        fs::create_dir(at.join("real")).unwrap();
        let long = format!("{MODEL}{}", "# a long story\n".repeat(100));
        fs::write(at.join("real/axle.toml"), &long).unwrap();
        fs::remove_file(at.join("axle.toml")).unwrap();
        symlink("real/axle.toml", at.join("axle.toml")).unwrap();
        fs::write(at.join("fit.html"), "whole").unwrap();
        let before = contents(&at);
        for line in [
            "identify axle.toml bench.csv --write axle.toml",
            "identify axle.toml bench.csv --report fit.html",
            "run axle.toml --out .",
        ] {
            for (trap, code) in [("trap '' XFSZ; ", Some(2)), ("", None)] {
                let mut shell = Command::new("sh");
                let kardan = env!("CARGO_BIN_EXE_kardan");
                shell.current_dir(&at).arg("-c").arg(format!("ulimit -c 0; {trap}ulimit -f 1; exec {kardan} {line}"));
                let got = shell.stdin(Stdio::null()).output().unwrap();
                assert_eq!(got.status.code(), code, "{line}: {}", plain_text(&got.stderr));
                assert!(
                    code.is_none() || plain_text(&got.stderr).contains("larger than the system allows"),
                    "{}",
                    plain_text(&got.stderr)
                );
                let after = contents(&at);
                for (path, bytes) in &before {
                    assert!(after[path] == *bytes, "{line}: {}", path.display());
                }
                assert!(
                    after.keys().all(|path| before.contains_key(path) || is_part(path)),
                    "{line}: {:?}",
                    after.keys()
                );
                assert!(code.is_none() || !after.keys().any(|path| is_part(path)), "{line}");
                after.keys().filter(|path| is_part(path)).for_each(|path| fs::remove_file(path).unwrap());
            }
        }
    }
}

/// A log that says it has 10¹⁸ rows is refused in little memory.
#[cfg(target_os = "linux")]
#[test]
fn endless_rows_of_a_log_are_not_allocated() {
    let at = folder("endless");
    let got = kardan(&at, &["-q", "bench", "axle.toml", "--format", "mdf,mat", "--out", "logs"]);
    assert_eq!(got.status.code(), Some(0), "{}", plain_text(&got.stderr));
    let huge = 1_000_000_000_000_000_000u64.to_le_bytes();
    let mdf = fs::read(at.join("logs/axle-1.mf4")).unwrap();
    // All rows that were written are there, whatever the block says of its length.
    let whole = "\"rows\":2201,";
    let group = mdf.windows(4).position(|four| four == b"##CG").unwrap();
    let data = mdf.windows(4).position(|four| four == b"##DT").unwrap();
    let links = u64::from_le_bytes(*mdf[group + 16..].first_chunk().unwrap()) as usize;
    let mat = fs::read(at.join("logs/axle-1.mat")).unwrap();
    // Rows of the group, the length of its data; both sizes of a matrix in a MAT file.
    let cases = [
        ("rows.mf4", &mdf, group + 24 + 8 * links + 8),
        ("data.mf4", &mdf, data + 8),
        ("size.mat", &mat, 128 + 8 + 16 + 8),
    ];
    for (name, bytes, place) in cases {
        let mut lies = bytes.clone();
        lies[place..place + 8].copy_from_slice(if name == "size.mat" {
            &[0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 0x7f]
        } else {
            &huge
        });
        fs::write(at.join(name), lies).unwrap();
        let kardan = env!("CARGO_BIN_EXE_kardan");
        let mut shell = Command::new("sh");
        shell.current_dir(&at).envs([("RAYON_NUM_THREADS", "2"), ("MALLOC_ARENA_MAX", "2")]).stdin(Stdio::null());
        shell.arg("-c").arg(format!("ulimit -v 1000000; exec {kardan} -q identify axle.toml {name} --json"));
        let got = shell.output().unwrap();
        let stderr = plain_text(&got.stderr);
        assert!(
            got.status.code().is_some() && !stderr.contains("panicked") && !stderr.contains("memory"),
            "{name}: {stderr}"
        );
        let all = format!("{stderr} {}", plain_text(&got.stdout));
        assert!(
            ["damaged", "truncated", "left out", "omits", whole].iter().any(|part| all.contains(part)),
            "{name}: {all}"
        );
    }
}

/// Lets operation after operation of a command fail, and kills it there. All files that were whole stay, or are replaced by whole
/// ones; a command that could not write says so; what a killed one leaves is swept away by the next. With `over` old results are
/// there, which are replaced; without, what is there of the results is whole.
#[cfg(debug_assertions)]
fn every_operation_fails(name: &str, arguments: &[&str], over: bool) {
    // What the command writes where nothing fails.
    let model = folder(&format!("{name}-whole"));
    let before = contents(&model).len();
    let good = kardan(&model, arguments);
    assert_eq!(good.status.code(), Some(0), "{arguments:?}: {}", plain_text(&good.stderr));
    let relative = |at: &Path| -> BTreeMap<PathBuf, Vec<u8>> {
        contents(at).into_iter().map(|(path, bytes)| (path.strip_prefix(at).unwrap().to_owned(), bytes)).collect()
    };
    let whole = relative(&model);
    assert!(over || whole.len() > before, "{arguments:?} writes nothing");
    for way in ["fail", "full", "kill"] {
        let at = folder(&format!("{name}-{way}"));
        // Old results that were whole.
        for path in whole.keys().filter(|path| over && !at.join(path).exists()) {
            fs::create_dir_all(at.join(path).parent().unwrap()).unwrap();
            // `--force` replaces rows of a sweep only where kardan has written them.
            fs::write(at.join(path), "PAR1, old and whole, of a kardan:sweep").unwrap();
        }
        let old = relative(&at);
        let mut done = false;
        for number in 0..400 {
            let got = command(&at, arguments).env("KARDAN_FAULT", format!("{way}:{number}")).output().unwrap();
            let after = relative(&at);
            for path in old.keys() {
                assert!(after.contains_key(path), "{arguments:?}, {way} {number}: {} is gone", path.display());
            }
            for (path, now) in after.iter().filter(|(path, _)| !(way == "kill" && is_part(path))) {
                assert!(
                    old.get(path) == Some(now) || whole.get(path) == Some(now),
                    "{arguments:?}, {way} {number}: {} is neither the old nor the new one",
                    path.display()
                );
            }
            if got.status.code() == Some(0) {
                assert!(number > 0, "{arguments:?}: no operation is counted");
                assert!(after == whole, "{arguments:?}, {way} {number}: says that all is written");
                done = true;
                break;
            }
            match way {
                "kill" => assert_eq!(got.status.code(), None, "{}", plain_text(&got.stderr)),
                _ => {
                    let stderr = plain_text(&got.stderr);
                    assert_eq!(got.status.code(), Some(2), "{stderr}");
                    assert!(stderr.contains("no space left"), "{arguments:?}, {way} {number}: {stderr}");
                }
            }
            // The model may have become the new one, and results may be there that were not.
            for path in after.keys().filter(|path| !old.contains_key(*path) && !is_part(path)) {
                fs::remove_file(at.join(path)).unwrap();
            }
            for (path, bytes) in &old {
                fs::write(at.join(path), bytes).unwrap();
            }
        }
        assert!(done, "{arguments:?}, {way}: never done");
        assert!(!contents(&at).keys().any(|path| is_part(path)), "leftovers are swept");
    }
}

#[cfg(debug_assertions)]
mod faults {
    use super::*;

    /// Each command that there is, with all that it can write.
    const COMMANDS: [(&str, &[&str], bool); 22] = [
        ("run-csv", &["run", "axle.toml", "--format", "csv", "--no-report"], true),
        ("run-parquet", &["run", "axle.toml", "--format", "parquet", "--no-report"], true),
        ("run-mat", &["run", "axle.toml", "--format", "mat", "--no-report"], true),
        ("run-mdf", &["run", "axle.toml", "--format", "mdf", "--no-report"], true),
        ("run-report", &["run", "axle.toml", "--json"], true),
        ("run-new", &["run", "axle.toml", "--out", "new/folder"], false),
        ("analyze", &["analyze", "axle.toml", "--report", "page.html"], true),
        ("analyze-json", &["analyze", "axle.toml", "--json", "--report", "new/page.html"], false),
        (
            "design",
            &[
                "design",
                "axle.toml",
                "--outputs",
                "axle.phi",
                "--report",
                "page.html",
                "--controller",
                "c.json",
                "--no-simulation",
            ],
            true,
        ),
        ("identify", &["identify", "axle.toml", "bench.csv", "--report", "page.html", "--write", "axle.toml"], true),
        ("bench", &["bench", "axle.toml", "--format", "csv,mdf"], true),
        ("bench-study", &["bench", "study.toml", "--study", "--out", "study"], true),
        ("safety", &["safety", "faults.toml", "--report", "page.html", "--csv", "faults.csv"], true),
        ("sweep", &["sweep", "swept.toml", "--samples", "3", "--out", "swept", "--force"], true),
        ("models-write", &["models", "two-bodies", "--write", "new.toml"], false),
        ("models", &["models"], true),
        ("check", &["check", "axle.toml"], true),
        ("equations", &["equations", "axle.toml"], true),
        ("linearise", &["linearise", "axle.toml", "--format", "mat", "--out", "abcd.mat"], true),
        ("elements", &["elements", "shaft"], true),
        ("completions", &["completions", "bash"], true),
        ("schema", &["schema", "run"], true),
    ];

    fn all_of(command: &str) {
        let own = COMMANDS.iter().filter(|(_, arguments, _)| arguments[0] == command);
        assert!(own.map(|(name, arguments, over)| every_operation_fails(name, arguments, *over)).count() > 0);
    }

    #[test]
    fn no_command_is_forgotten() {
        let help = kardan(Path::new(env!("CARGO_TARGET_TMPDIR")), &["--help"]);
        let help = String::from_utf8(help.stdout).unwrap();
        let listed = help.lines().skip_while(|line| !line.starts_with("Commands:")).skip(1);
        // Deeper lines go on with what was begun.
        let begins = |line: &&str| line.starts_with("  ") && !line.starts_with("   ");
        let listed: Vec<&str> = listed
            .take_while(|line| !line.is_empty())
            .filter(begins)
            .filter_map(|line| line.split_whitespace().next())
            .collect();
        assert!(listed.len() >= 10, "{help}");
        for command in listed.iter().filter(|command| **command != "help") {
            assert!(COMMANDS.iter().any(|(_, arguments, _)| arguments[0] == *command), "`{command}` is not tried");
        }
    }

    #[test]
    fn of_run() {
        all_of("run");
    }

    #[test]
    fn of_analyze_and_design() {
        all_of("analyze");
        all_of("design");
    }

    #[test]
    fn of_identify() {
        all_of("identify");
    }

    #[test]
    fn of_bench() {
        all_of("bench");
    }

    #[test]
    fn of_safety() {
        all_of("safety");
    }

    #[test]
    fn of_sweep() {
        all_of("sweep");
    }

    #[test]
    fn of_what_only_prints_and_copies() {
        for command in ["models", "check", "equations", "linearise", "elements", "completions", "schema"] {
            all_of(command);
        }
    }
}
