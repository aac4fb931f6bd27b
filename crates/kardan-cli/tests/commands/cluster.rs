//! `kardan sweep --on`: jobs from templates, followed to their end, what failed submitted again. Schedulers are small scripts that really run the
//! shards; real ones are in `tests/cluster`.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use super::sweep::MODEL;

/// What all schedulers of these tests do with a job: they run its tasks one after the other while `running` is there. At the first submission shard 2
/// may not write files of more than a block and shard 3 is never begun; where `hold` is there nothing begins.
const SCHEDULER: &str = r##"
cd "$FAKE" || exit 1
submit() {
  touch running; echo "$2" >>submitted; turn=$(wc -l <submitted)
  ( while [ -e hold ]; do sleep 0.02; done
    for i in $2; do
      case "$turn$i" in
        12) (ulimit -f 1; run "$1" 2) ;;
        13) ;;
        *) run "$1" "$i" ;;
      esac
    done; rm running ) >/dev/null 2>&1 </dev/null &
}
numbers() { for range in $(echo "$1" | tr , ' '); do seq "${range%-*}" "${range#*-}"; done | tr '\n' ' '; }
for job; do :; done
"##;

const SBATCH: &str = r##"run() { SLURM_ARRAY_TASK_ID=$2 sh "$1"; }
submit "$job" "$(numbers "$(sed -n 's/^#SBATCH --array=//p' "$job")")"; echo "41;loopback""##;
const SQUEUE: &str = r##"[ -e asked ] || { touch asked; echo "cannot connect" >&2; exit 1; }
[ ! -e running ] || echo 41; echo 7"##;
const HQ: &str = r##"run() { HQ_TASK_ID=$2 sh "$1"; }
case "$*" in
  *submit*) submit "$job" "$(numbers "$(sed -n 's/^#HQ --array=//p' "$job")")"; echo 41 ;;
  *list*) echo "7 RUNNING"; [ ! -e running ] || echo "41 RUNNING" ;;
esac"##;
const KUBECTL: &str = r##"run() {
  sed -n '/args:/,/resources:/p' "$1" | sed '1,2d;$d;s/^ *//' >pod.sh
  JOB_COMPLETION_INDEX=$(($2 - 1)) sh pod.sh
}
case "$*" in
  create*) submit "$job" "$(sed -n 's/^ *set -- //p' "$job")"; echo job.batch/it ;;
  *get*job.batch/it*) if [ -e running ]; then echo it; else echo it SuccessCriteriaMet Complete; fi ;;
esac"##;
const MPIRUN: &str = r##"cd "$FAKE"; echo "$*" >>submitted
for rank in 0 1 2; do OMPI_COMM_WORLD_RANK=$rank OMPI_COMM_WORLD_SIZE=3 "$@" & done; wait"##;

struct Place(PathBuf);

impl Place {
    /// A folder with the model, and the programs `name` with this text on its path.
    fn new(name: &str, programs: &[(&str, &str)]) -> Self {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("cluster {name}"));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(path.join("bin")).unwrap();
        fs::write(path.join("m.toml"), MODEL).unwrap();
        let place = Self(path);
        programs.iter().for_each(|(name, text)| place.program(name, text));
        place
    }

    fn program(&self, name: &str, text: &str) {
        let path = self.0.join("bin").join(name);
        fs::write(&path, format!("#!/bin/sh\n{SCHEDULER}\n{text}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
        let path = format!("{}:{}", self.0.join("bin").display(), std::env::var("PATH").unwrap());
        command
            .current_dir(&self.0)
            .args(arguments)
            .stdin(Stdio::null())
            .env("PATH", path)
            .env("FAKE", &self.0)
            .env_remove("KARDAN");
        command
    }

    fn kardan(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// `kardan sweep m.toml --samples 450 --seed 3` with more.
    fn sweep(&self, more: &[&str]) -> Output {
        self.kardan(&[&["sweep", "m.toml", "--samples", "450", "--seed", "3"], more].concat())
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap_or_default()
    }

    /// Runs it by one process, and whether the answers in the folder are the same, bit by bit.
    fn is_whole(&self, folder: &str) {
        let whole = self.0.join("whole/sweep.json");
        if !whole.exists() {
            self.sweep(&["--out", "whole"]);
        }
        assert!(fs::read(whole).unwrap() == fs::read(self.0.join(folder).join("sweep.json")).unwrap(), "{folder}");
    }
}

/// All words of what it said.
fn stderr_text(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr).replace('│', " ");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn any_number_of_shards_on_this_machine_is_the_whole() {
    let at = Place::new("local", &[]);
    for (shards, threads) in [("1", "1"), ("7", "1"), ("8", "2")] {
        let got = at.sweep(&["--on", "local", "--shards", shards, "--threads", threads, "--out", shards]);
        assert_eq!(got.status.code(), Some(1), "{}", stderr_text(&got));
        at.is_whole(shards);
    }
    let parts = fs::read_dir(at.0.join("7/parts")).unwrap().count();
    assert_eq!((parts, at.read("7/jobs.txt").lines().nth(1).unwrap()), (7, "shards 7"));
}

/// One shard of seven is killed at its first block, by the limit of a file's size, and runs again; the others do not.
#[test]
fn a_shard_that_was_killed_is_run_again() {
    let at = Place::new("killed", &[]);
    let template = "cd ..; echo {{list}} >>tries; for i in {{list}}; do\n\
                    if [ $i = 2 ] && ! [ -e once ]; then touch once; (ulimit -f 1; {{shard}} $i); else {{shard}} $i; fi; done\n";
    fs::write(at.0.join("mine.sh"), format!("cd '{}/bin'\n{template}", at.0.display())).unwrap();
    let more = ["--on", "local", "--shards", "7", "--template", "mine.sh", "--out", "o"];
    let got = at.sweep(&[&more[..], &["--retries", "0"]].concat());
    let error = stderr_text(&got);
    assert!(got.status.code() == Some(2) && error.contains("1 of 7 shards are not done (2); shard 2: "), "{error}");
    assert!(error.contains("with `--resume` reruns only them"), "{error}");
    let done = fs::metadata(at.0.join("o/parts/1/shard-1-of-7.json")).unwrap().modified().unwrap();
    fs::remove_file(at.0.join("once")).unwrap();
    let got = at.sweep(&[&more[..], &["--resume"]].concat());
    assert!(
        got.status.code() == Some(1) && stderr_text(&got).contains("1 of 7 shards have failed (2;"),
        "{}",
        stderr_text(&got)
    );
    at.is_whole("o");
    assert_eq!(at.read("tries"), "1 2 3 4 5 6 7\n2\n2\n");
    assert_eq!(fs::metadata(at.0.join("o/parts/1/shard-1-of-7.json")).unwrap().modified().unwrap(), done);
    // All are done: nothing runs.
    assert_eq!(at.sweep(&[&more[..], &["--resume"]].concat()).status.code(), Some(1));
    assert_eq!(at.read("tries").lines().count(), 3);
}

/// Each scheduler loses a shard and never begins another; they are submitted again, alone.
#[test]
fn schedulers_are_followed_and_what_failed_is_submitted_again() {
    for (on, programs) in [("slurm", &[("sbatch", SBATCH), ("squeue", SQUEUE)][..]), ("hyperqueue", &[("hq", HQ)])] {
        let at = Place::new(on, programs);
        let got = at.sweep(&["--on", on, "--shards", "4", "--out", "o o"]);
        assert_eq!(got.status.code(), Some(1), "{}", stderr_text(&got));
        at.is_whole("o o");
        assert_eq!(at.read("submitted"), "1 2 3 4 \n2 3 \n", "{on}");
        let notes = stderr_text(&got);
        assert!(notes.contains("2 of 4 shards have failed (2-3; "), "{notes}");
        assert!(on != "slurm" || notes.contains("slurm does not answer (cannot connect)"), "{notes}");
        assert_eq!(at.read("o o/jobs.txt").matches(&format!("job {on} 41\n")).count(), 2);
    }
}

/// A job of Kubernetes tries its indices again by itself: kardan submits once, and what is missing by `--resume`.
#[test]
fn indexed_jobs_name_the_shards_that_are_missing() {
    let at = Place::new("kubernetes", &[("kubectl", KUBECTL)]);
    let more = ["--on", "kubernetes", "--shards", "4", "--retries", "5", "--out", "o"];
    let got = at
        .command(&[&["sweep", "m.toml", "--samples", "450", "--seed", "3"], &more[..]].concat())
        .env("KARDAN", env!("CARGO_BIN_EXE_kardan"))
        .output()
        .unwrap();
    assert!(
        got.status.code() == Some(2) && stderr_text(&got).contains("shard 3: it has not started"),
        "{}",
        stderr_text(&got)
    );
    assert!(
        at.read("o/job.yaml").contains("backoffLimitPerIndex: 5\n")
            && at.read("o/job.yaml").contains("completions: 4\n")
    );
    // Indices count from 0: those of 2 and 3 are 0 and 1 of the second job, which the scheduler of this test calls by the first two of its list.
    at.program("kubectl", &KUBECTL.replace("$(($2 - 1))", "$(($2 - 2))"));
    let got = at.sweep(&[&more[..], &["--resume"]].concat());
    assert_eq!(got.status.code(), Some(1), "{}", stderr_text(&got));
    at.is_whole("o");
    assert_eq!(at.read("submitted"), "1 2 3 4\n2 3\n");
    let job = at.read("o/job.yaml");
    assert!(job.contains("completions: 2\n") && job.contains(&format!("mountPath: \"{}\"", at.0.display())), "{job}");
}

/// The part of YAML that jobs are written in: maps and lists by their indentation, texts in lines behind `|`, plain and quoted words.
fn read_yaml(lines: &mut std::iter::Peekable<std::vec::IntoIter<(usize, String)>>) -> serde_json::Value {
    let Some(&(depth, _)) = lines.peek() else { return serde_json::Value::Null };
    let (mut list, mut map) = (Vec::new(), serde_json::Map::new());
    while let Some((_, line)) = lines.next_if(|(other, _)| *other == depth) {
        if let Some(item) = line.strip_prefix("- ") {
            let mut own = vec![(depth + 2, item.to_string())];
            while let Some(line) = lines.next_if(|(other, _)| *other > depth) {
                own.push(line);
            }
            let is_map = item.contains(": ") || item.ends_with(':');
            list.push(if is_map { read_yaml(&mut own.into_iter().peekable()) } else { text_of(item, &own[1..]) });
            continue;
        }
        let (key, value) = line.split_once(':').unwrap_or_else(|| panic!("no key: {line}"));
        let value = match value.trim() {
            "" => read_yaml(lines),
            word => text_of(word, &[]),
        };
        assert!(map.insert(key.into(), value).is_none(), "`{key}` is there twice");
    }
    if list.is_empty() { map.into() } else { list.into() }
}

/// A word, or the lines behind `|`. Quoted words and lists in brackets are those of JSON.
fn text_of(word: &str, lines: &[(usize, String)]) -> serde_json::Value {
    match word {
        "|" => lines.iter().map(|(_, line)| format!("{line}\n")).collect::<String>().into(),
        _ => serde_json::from_str(word).unwrap_or_else(|_| word.into()),
    }
}

/// The job is one of Kubernetes by the published schema of its API, in which there are no other names.
#[test]
fn jobs_of_kubernetes_follow_the_published_schema() {
    let at = Place::new("schema", &[]);
    let got = at.sweep(&["--on", "kubernetes", "--shards", "4", "--out", "o o", "--dry-run"]);
    assert_eq!(got.status.code(), Some(0), "{}", stderr_text(&got));
    let read = |text: &str| {
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        let lines = lines.map(|line| (line.len() - line.trim_start().len(), line.trim().to_string()));
        read_yaml(&mut lines.collect::<Vec<_>>().into_iter().peekable())
    };
    let schema: serde_json::Value =
        serde_json::from_str(include_str!("../cluster/kubernetes-job.schema.json")).unwrap();
    let (mut schemas, mut compiler) = (boon::Schemas::new(), boon::Compiler::new());
    compiler.add_resource("https://kardan.invalid/job", schema).unwrap();
    let schema = compiler.compile("https://kardan.invalid/job", &mut schemas).unwrap();
    let text = at.read("o o/job.yaml");
    let job = read(&text);
    schemas.validate(&job, schema).unwrap_or_else(|wrong| panic!("{wrong}\n{job}"));
    let pod = &job["spec"]["template"]["spec"];
    assert_eq!((&job["spec"]["completions"], &job["spec"]["completionMode"]), (&4.into(), &"Indexed".into()));
    let script =
        format!("set -- 1 2 3 4\nshift \"$JOB_COMPLETION_INDEX\"\nexec sh '{}/o o/shard.sh' \"$1\"\n", at.0.display());
    assert_eq!(pod["containers"][0]["args"], serde_json::json!([script]));
    // The schema and the reader see what is wrong.
    for (good, bad) in [
        ("backoffLimitPerIndex", "backoffLimitForIndex"),
        ("completions: 4", "completions: four"),
        ("claimName: kardan", "claim: kardan"),
        ("restartPolicy", "restart"),
        ("apiVersion: batch/v1", "apiVersion: batch/v2"),
        ("  mountPath", "  mount"),
    ] {
        assert!(text.contains(good) && schemas.validate(&read(&text.replace(good, bad)), schema).is_err(), "{bad}");
    }
}

#[test]
fn ranks_of_mpi_share_the_shards() {
    let at = Place::new("mpi", &[]);
    let mpirun = at.0.join("bin/mpirun");
    fs::write(&mpirun, format!("#!/bin/sh\n{MPIRUN}\n")).unwrap();
    fs::set_permissions(&mpirun, fs::Permissions::from_mode(0o755)).unwrap();
    let got = at.sweep(&["--on", "mpi", "--shards", "8", "--out", "o"]);
    assert_eq!(got.status.code(), Some(1), "{}", stderr_text(&got));
    at.is_whole("o");
    assert_eq!(at.read("submitted").lines().count(), 1);
}

/// A signal ends the command, not its job; the same command with `--resume` follows that job, and submits nothing.
#[test]
fn a_job_of_an_interrupted_command_is_followed() {
    let at = Place::new("left", &[("sbatch", SBATCH), ("squeue", SQUEUE)]);
    fs::write(at.0.join("hold"), "").unwrap();
    let more = ["sweep", "m.toml", "--samples", "450", "--seed", "3", "--on", "slurm", "--shards", "4", "--out", "o"];
    let child = at.command(&more).stderr(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let begun = Instant::now();
    while !at.read("o/jobs.txt").contains("job slurm 41") {
        assert!(begun.elapsed() < Duration::from_secs(60), "nothing was submitted");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let got = child.wait_with_output().unwrap();
    let error = stderr_text(&got);
    assert!(
        got.status.code() == Some(2) && error.contains("job 41 stays in the queue (`scancel 41` ends it)"),
        "{error}"
    );
    fs::remove_file(at.0.join("hold")).unwrap();
    let got = at.kardan(&[&more[..], &["--resume"]].concat());
    assert_eq!(got.status.code(), Some(1), "{}", stderr_text(&got));
    assert!(
        stderr_text(&got).contains("kardan follows job 41 of slurm, 4 shards are missing"),
        "{}",
        stderr_text(&got)
    );
    at.is_whole("o");
    // The second submission is that of what failed.
    assert_eq!(at.read("submitted"), "1 2 3 4 \n2 3 \n");
}

/// Processes of one's own end with the command, keep their blocks, and go on.
#[test]
fn processes_of_this_machine_end_with_the_command() {
    let at = Place::new("ended", &[]);
    fs::write(
        at.0.join("mine.sh"),
        "cd '{{out}}'; echo $$ >../pid; sleep 600; {{shard}} {{list}}".replace("'{{out}}'", "{{out}}"),
    )
    .unwrap();
    let more = ["--on", "local", "--shards", "2", "--template", "mine.sh", "--out", "o", "--time-limit", "1"];
    let got = at.sweep(&more);
    let error = stderr_text(&got);
    assert!(
        got.status.code() == Some(2)
            && error.contains("2 of 2 shards are missing")
            && error.contains("kardan stops its processes"),
        "{error}"
    );
    let alive = Command::new("kill").args(["-0", at.read("pid").trim()]).stderr(Stdio::null()).status().unwrap();
    assert!(!alive.success(), "the script of the job is still there");
    let got = at.sweep(&["--on", "local", "--out", "o", "--resume"]);
    assert_eq!(got.status.code(), Some(1), "{}", stderr_text(&got));
    at.is_whole("o");
}

/// Without the scheduler the job is written all the same; `--dry-run` asks for none.
#[test]
fn jobs_are_written_if_no_scheduler_is_installed() {
    let at = Place::new("written", &[]);
    let empty = at.0.join("empty");
    fs::create_dir_all(&empty).unwrap();
    for (on, program, file, line) in [
        ("slurm", "sbatch", "job.sh", "#SBATCH --array=1-6\n"),
        ("hyperqueue", "hq", "job.sh", "#HQ --array=1-6\n"),
        ("kubernetes", "kubectl", "job.yaml", "completionMode: Indexed\n"),
        ("mpi", "mpirun", "job.sh", "for shard in 1 2 3 4 5 6; do\n"),
        ("local", "sh", "job.sh", "xargs -n 1 -P "),
    ] {
        let arguments = ["sweep", "m.toml", "--samples", "450", "--on", on, "--shards", "6", "--out", on];
        let dry = at.command(&[&arguments[..], &["--dry-run"]].concat()).env("PATH", &empty).output().unwrap();
        let job = at.read(&format!("{on}/{file}"));
        assert!(dry.status.code() == Some(0) && job.contains(line), "{on}: {job}");
        assert!(
            String::from_utf8_lossy(&dry.stdout) == job && stderr_text(&dry).contains("not submitted: run"),
            "{on}: {}",
            stderr_text(&dry)
        );
        fs::remove_file(at.0.join(on).join(file)).unwrap();
        // What was written only is not in the way.
        let got = at.command(&arguments).env("PATH", &empty).output().unwrap();
        let error = stderr_text(&got);
        assert!(
            got.status.code() == Some(2) && error.contains(&format!("`{program}` is not installed")),
            "{on}: {error}"
        );
        assert!(error.contains("help: install ") && at.read(&format!("{on}/{file}")) == job, "{on}: {error}");
        let template = at.kardan(&["sweep", "template", on]);
        assert!(template.status.code() == Some(0) && String::from_utf8_lossy(&template.stdout).contains("{{shard}}"));
    }
}

/// Paths with all that a shell reads are one word of it, whatever a template does with them.
#[test]
fn paths_are_quoted_for_the_shell_in_templates() {
    let at = Place::new("quo'te $HOME `id` \"x\" !y", &[]);
    let template = "cd {{root}} && pwd >pwd.txt\nfor path in {{out}} {{logs}} {{root}} {{kardan}}; do\n\
                    test -e \"$path\" || echo \"$path\" >>missing.txt; done\nfor i in {{list}}; do {{shard}} $i; done\n";
    fs::write(at.0.join("mine.sh"), template).unwrap();
    let got = at.sweep(&["--on", "local", "--shards", "2", "--template", "mine.sh", "--out", "o o"]);
    assert_eq!(got.status.code(), Some(1), "{}", stderr_text(&got));
    at.is_whole("o o");
    assert_eq!((at.read("pwd.txt").trim_end(), at.read("missing.txt").as_str()), (at.0.to_str().unwrap(), ""));
    // YAML and a shell read no word alike that has both quotes.
    let got = at.sweep(&["--on", "kubernetes", "--shards", "2", "--out", "k", "--dry-run"]);
    assert!(got.status.code() == Some(2) && stderr_text(&got).contains("read differently"), "{}", stderr_text(&got));
}

/// Whose record `jobs.txt` is not, or that was damaged, is refused; nothing of it is believed, and nothing of others is removed.
#[test]
fn foreign_records_and_files_stay() {
    let at = Place::new("others", &[]);
    let local = ["--on", "local", "--shards", "2", "--out", "o"];
    assert_eq!(at.sweep(&local).status.code(), Some(1));
    let record = at.read("o/jobs.txt");
    let foreign = ["parts/notes.txt", "parts/1/notes.txt", "logs/mine.log", "logs/3.log"];
    foreign.iter().for_each(|name| fs::write(at.0.join("o").join(name), "mine").unwrap());
    for text in [
        "",
        "mine\n",
        "\0\u{1}",
        "sweep x\nshards 18446744073709551615\n",
        "sweep kardan 0\nshards 99999999999999999999999\n",
        &record.replace("shards 2", "shards 1000000000000"),
        &record.replace("shards 2", "shards 0"),
        &record.replace("sweep ", "sweep"),
        &(record.clone() + "job slurm 41\n"),
    ] {
        fs::write(at.0.join("o/jobs.txt"), text).unwrap();
        for more in [&[][..], &["--resume"], &["--force"]] {
            let got = at.sweep(&[&local[..], more].concat());
            assert!(
                got.status.code() == Some(2)
                    && stderr_text(&got).contains("jobs.txt`: ")
                    && stderr_text(&got).contains("kardan cannot resume"),
                "{text}: {}",
                stderr_text(&got)
            );
        }
        assert_eq!(at.read("o/jobs.txt"), text);
    }
    fs::write(at.0.join("o/jobs.txt"), &record).unwrap();
    let got = at.sweep(&[&local[..], &["--force"]].concat());
    assert_eq!(got.status.code(), Some(1), "{}", stderr_text(&got));
    at.is_whole("o");
    assert!(foreign.iter().all(|name| at.read(&format!("o/{name}")) == "mine"));
    // Without a record nothing there is known to be of a sweep.
    for name in ["parts/x", "logs/1.log", "shard.sh", "job.sh"] {
        let _ = fs::remove_dir_all(at.0.join("p"));
        let own = at.0.join("p").join(name);
        fs::create_dir_all(own.parent().unwrap()).unwrap();
        fs::write(&own, "mine").unwrap();
        for more in [&[][..], &["--force"]] {
            let got = at.sweep(&[&["--on", "local", "--shards", "2", "--out", "p"], more].concat());
            assert!(
                got.status.code() == Some(2) && stderr_text(&got).contains("is in the way"),
                "{name}: {}",
                stderr_text(&got)
            );
        }
        assert_eq!(fs::read(own).unwrap(), b"mine");
    }
}

#[test]
fn nonsense_is_refused_before_something_is_submitted() {
    let at = Place::new("nonsense", &[("sbatch", SBATCH), ("squeue", SQUEUE)]);
    for (name, text) in [
        ("shar.sh", "{{list}}\n{{shar}} {{shard}}"),
        ("open.sh", "{{shard}} {{list}} {{array"),
        ("no.sh", "{{list}}"),
        ("none.sh", "{{shard}} 1"),
    ] {
        fs::write(at.0.join(name), text).unwrap();
    }
    fs::write(at.0.join("utf16.sh"), b"\xff\xfe{\0{\0").unwrap();
    fs::write(at.0.join("empty.sh"), "\n").unwrap();
    let on = ["--on", "slurm", "--out", "o"];
    for (more, reported) in [
        (&["--on", "slurm"][..], "--out"),
        (&["--on", "pbs", "--out", "o"], "possible values: slurm, hyperqueue, kubernetes, mpi, local"),
        (&["--dry-run", "--out", "o"], "--on"),
        (&["--retries", "1", "--out", "o"], "--on"),
        (&[&on[..], &["--retries", "-1"]].concat(), "unexpected argument"),
        (&[&on[..], &["--retries", "many"]].concat(), "invalid digit"),
        (&[&on[..], &["--retries", "101"]].concat(), "101 is not in 0..=100"),
        (&[&on[..], &["--shards", "0"]].concat(), "0 is not in 1..=1000"),
        (&[&on[..], &["--shards", "1001"]].concat(), "1001 is not in 1..=1000"),
        (
            &[&on[..], &["--shards", "9"]].concat(),
            "9 shards: 450 samples are only 8 blocks; 1 shards would have none help: at most `--shards 8`",
        ),
        (&[&on[..], &["--threads", "0"]].concat(), "0 is not in 1..=1024"),
        (&[&on[..], &["--shard", "1/2"]].concat(), "cannot be used with"),
        (&[&on[..], &["--template", "nowhere.sh"]].concat(), "there is no file `nowhere.sh`"),
        (
            &[&on[..], &["--template", "shar.sh"]].concat(),
            "`shar.sh`, line 2: there is no `{{shar}}` help: did you mean `{{shard}}`?",
        ),
        (&[&on[..], &["--template", "open.sh"]].concat(), "`open.sh`, line 1: `{{` without `}}`"),
        (&[&on[..], &["--template", "utf16.sh"]].concat(), "`utf16.sh` is UTF-16 text; kardan reads UTF-8"),
        (
            &[&on[..], &["--template", "empty.sh"]].concat(),
            "`empty.sh` is empty help: start from kardan's template: `kardan sweep template slurm` prints one",
        ),
        (&[&on[..], &["--template", "no.sh"]].concat(), "has no `{{shard}}`"),
        (&[&on[..], &["--template", "none.sh"]].concat(), "has no `{{array}}` or `{{list}}`"),
        (&["--on", "slurm", "--out", "m.toml"], "exists already and is a file"),
    ] {
        let got = at.sweep(more);
        assert!(
            got.status.code() == Some(2) && stderr_text(&got).contains(reported),
            "{more:?}: {}",
            stderr_text(&got)
        );
    }
    let got = at.kardan(&["sweep", "-", "--on", "slurm", "--out", "o"]);
    assert!(
        got.status.code() == Some(2) && stderr_text(&got).contains("a model from standard input"),
        "{}",
        stderr_text(&got)
    );
    assert!(!at.0.join("submitted").exists());
    // A folder is of one sweep in one number of shards.
    let local = ["--on", "local", "--out", "l", "--shards", "2"];
    assert_eq!(at.sweep(&local).status.code(), Some(1));
    for (more, reported) in [
        (&local[..], "already contains rows of a sweep"),
        (&["--on", "local", "--out", "l", "--shards", "3", "--resume"], "its sweep has 2 shards, not 3"),
        (&["--on", "local", "--out", "l", "--tolerance", "1e-6", "--resume"], "it is of another sweep"),
    ] {
        let got = at.sweep(more);
        assert!(
            got.status.code() == Some(2) && stderr_text(&got).contains(reported),
            "{more:?}: {}",
            stderr_text(&got)
        );
    }
    assert_eq!(at.sweep(&["--on", "local", "--out", "l", "--shards", "3", "--force"]).status.code(), Some(1));
    at.is_whole("l");
    assert!(at.0.join("l/parts/3").exists() && !at.0.join("l/parts/1/shard-1-of-2.json").exists());
    // What a scheduler says of a job that it does not take is told.
    at.program("sbatch", "echo 'sbatch: error: invalid partition' >&2; exit 1");
    let got = at.sweep(&on);
    assert!(got.status.code() == Some(2) && stderr_text(&got).contains("rejected `"), "{}", stderr_text(&got));
    assert!(stderr_text(&got).contains("invalid partition"), "{}", stderr_text(&got));
}
