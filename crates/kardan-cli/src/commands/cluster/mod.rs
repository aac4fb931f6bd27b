//! `kardan sweep --on`: the shards of a sweep as a job of a scheduler, followed until all are done, and merged.
//!
//! The folder stores all state between two commands: `jobs.txt` (the sweep, the number of shards, and the submitted jobs),
//! `shard.sh` (runs one shard), `job.sh` or `job.yaml` (runs many, made from a template), `parts/I` (the rows of a shard, and its manifest when it is
//! done), `logs/I.log`. A shard is done when its manifest exists, whatever a queue reports. A command that resumes reads the existing files:
//! a shard whose manifest or rows are damaged or missing is not done.

mod queue;
mod record;
mod template;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use kardan::diagnostics::Diagnostic;
use kardan::num::Random;
use kardan::project::Project;
use kardan::study::{Shard, SweepPlan};

use self::queue::Queue;
use self::record::{MOST_SHARDS, Record};
use self::template::{check, fill, ranges};
use super::model_store::{store_model, stored_model};
use super::rows::{
    RESUME_OR_FORCE, files_of_rows, has_rows, is_whole, own_files, path_of_manifest, removed, shard_counts,
};
use super::sweep::{merge, prepared_folder, settings};
use crate::args::{MergeArgs, SweepArgs, Target, word};
use crate::exit::{DONE, done};
use crate::files::{self, reason};
use crate::input;
use crate::lock::Lock;
use crate::output::{prepare_folder_in, print, quoted_for_shell, save_in, stays};
use crate::render::{Failure, note};
use crate::stop;

/// What runs one shard.
const SHARD: &str = include_str!("templates/shard.sh");
/// Samples of a shard, if `--shards` is not given.
const SAMPLES: u64 = 1000;
/// The record of the submitted jobs.
const RECORD: &str = "jobs.txt";
/// The ends of names of logs: of the shard itself, and of queues.
const LOGS: [&str; 3] = ["log", "slurm", "hq"];
/// Polling interval of signals and of kardan's own processes.
const SLICE: Duration = Duration::from_millis(20);
/// Polling interval of the folder and the queue: initial and largest.
const POLL_INTERVALS: (Duration, Duration) = (Duration::from_millis(200), Duration::from_secs(10));
/// Consecutive polls of a queue without an answer before kardan reports an error.
const SILENCE: u32 = 30;
/// Time that kardan's own processes have to end after a signal.
const GRACE: Duration = Duration::from_secs(4);

/// `kardan sweep template`.
pub fn print_template(target: Target) -> Result<u8, Failure> {
    done(Queue::of(target).template)
}

/// `kardan sweep --on`.
pub fn sweep(args: &SweepArgs, target: Target, quiet: bool) -> Result<u8, Failure> {
    let mut work = Work::prepare(args, Queue::of(target), quiet)?;
    let missing = work.missing();
    if args.on.dry_run && missing.is_empty() {
        work.message("all shards are done: there is no job to write");
        return Ok(DONE);
    }
    if args.on.dry_run {
        let (path, text) = work.write_job(&missing)?;
        print(&text)?;
        work.message(&format!("wrote {}; not submitted: run `{}` to submit it", path.display(), work.by_hand(&path)));
        return Ok(DONE);
    }
    if let Some(job) = work.record.jobs.last().cloned().filter(|_| !missing.is_empty()) {
        work.go_on(&job, &missing)?;
    }
    let tries = if work.queue.retries_itself { 0 } else { args.on.retries };
    for again in 0..=tries {
        let missing = work.missing();
        if missing.is_empty() {
            break;
        }
        if again > 0 {
            let (which, why) = (ranges(&missing), work.why(missing[0]));
            let (count, all) = (missing.len(), work.record.shards);
            work.message(&format!(
                "{count} of {all} shards have failed ({which}; {why}): resubmitted, {again} of {tries}"
            ));
        }
        work.run(&missing)?;
    }
    let missing = work.missing();
    if !missing.is_empty() {
        return Err(work.failed(&missing).into());
    }
    let parts = work.all().iter().map(|number| work.part(*number)).collect();
    let (variants, changes) = (args.variants.clone(), args.changes.clone());
    let (out, json, method, tolerance) = (args.out.clone(), args.json, args.method, args.tolerance);
    let (max_steps, model) = (args.limits.max_steps, work.model);
    // The merge locks the folder by itself.
    drop(work.lock);
    merge(&MergeArgs { model, parts, variants, out, json, method, tolerance, max_steps, changes }, quiet)
}

/// A sweep that is run as shards.
struct Work<'a> {
    args: &'a SweepArgs,
    queue: &'static Queue,
    quiet: bool,
    model: PathBuf,
    /// The folder, from the root.
    out: PathBuf,
    /// Name and text of the template.
    template: (String, String),
    /// The sweep, its number of shards, and the jobs that were submitted from this folder.
    record: Record,
    /// Lock: no other sweep writes to the folder.
    lock: Option<Lock>,
}

impl<'a> Work<'a> {
    /// Checks for all possible errors before submitting, and writes the script that runs a shard.
    fn prepare(args: &'a SweepArgs, queue: &'static Queue, quiet: bool) -> Result<Self, Failure> {
        let model = args.model.clone().unwrap_or_default();
        if model.as_os_str() == "-" {
            let message = "`--on` cannot pass a model from standard input to its shards";
            return Err(Diagnostic::error("sweep::scheduler", message)
                .help("write it to a file that all machines see")
                .into());
        }
        let template = match &args.on.template {
            Some(path) => (path.display().to_string(), input::read_text(path).map_err(empty)?),
            None => (format!("kardan sweep template {}", queue.name), queue.template.into()),
        };
        check(&template.0, &template.1)?;
        let (source, project) = input::prepared(&model, &args.changes, quiet)?;
        let plan = project.sweep_plan(&settings(args));
        let plan = plan.map_err(|diagnostics| Failure { source: Some(source), diagnostics })?;
        let out = args.out.clone().unwrap_or_default();
        let out = std::path::absolute(&out).unwrap_or(out);
        let default_shards =
            plan.head.samples.div_ceil(SAMPLES).max(if queue.name == "local" { processes(args, u64::MAX) } else { 1 });
        let shards = args.on.shards.unwrap_or(default_shards.min(plan.blocks()).min(MOST_SHARDS));
        if shards > plan.blocks() {
            let message = format!(
                "{shards} shards: {} samples are only {} blocks; {} shards would have none",
                plan.head.samples,
                plan.blocks(),
                shards - plan.blocks()
            );
            let help = format!("at most `--shards {}`", plan.blocks());
            return Err(Diagnostic::error("sweep::shards", message).help(help).into());
        }
        let record = Record { sweep: plan.head.identity.replace('\n', " "), shards, jobs: Vec::new() };
        let mut work = Work { args, queue, quiet, model, out, template, record, lock: None };
        // All template words and paths are checked before a file is written.
        let job = fill(&work.template.0, &work.template.1, &work.values(&[1])?)?;
        if queue.name == "kubernetes" && job.contains("mountPath: \"/\"") {
            let message =
                format!("model and `{}` share no folder but `/`, which no volume can mount", work.out.display());
            let help = "put the model and the folder of `--out` into one folder, that of the claim";
            return Err(Diagnostic::error("sweep::scheduler", message).help(help).into());
        }
        work.lock = Some(prepared_folder(&work.out, None)?);
        work.take_up((&project, &plan))?;
        // From here on all files are of this sweep.
        work.save_record()?;
        for folder in ["parts", "logs"] {
            prepare_folder_in(&work.out, folder)?;
        }
        work.all().into_iter().flat_map(|number| work.files_of(number)).try_for_each(|path| stays(&work.out, &path))?;
        let script = fill("shard.sh", SHARD, &work.values(&[])?)?;
        save_in(&work.out, "shard.sh", script.as_bytes())?;
        store_model(&work.out, &project, &work.record.sweep)?;
        if work.args.resume {
            work.undo_damaged((&project, &plan))?;
        }
        Ok(work)
    }

    /// Reads the state of earlier commands from the folder; rejects a folder with another sweep, or with foreign files.
    fn take_up(&mut self, (project, plan): (&Project, &SweepPlan)) -> Result<(), Diagnostic> {
        let path = self.out.join(RECORD);
        let rows = files_of_rows(&self.out);
        if !rows.is_empty() && !self.args.force {
            let help = "they come from a sweep without `--on`: replace them with `--force`, or name another folder with --out DIR";
            return Err(has_rows(&self.out, help));
        }
        let refusal = |what: String, help: &str| {
            let message = format!("kardan cannot resume `{}`: {what}", path.display());
            Err(Diagnostic::error("sweep::resume", message).help(help))
        };
        let Ok(bytes) = files::read(&path) else { return self.check_unrecorded_folder(plan) };
        let record = match Record::read(&bytes) {
            Ok(record) => record,
            Err(why) => {
                let help = "kardan did not write it, or it is damaged: name another folder with --out DIR, or, if it is of this sweep, remove it and continue with `--resume`";
                return refusal(why, help);
            }
        };
        let begun = files::paths_in(&self.out.join("parts")).next().is_some();
        if self.args.force {
            return self.start_anew(record.shards);
        }
        // A job that was written but not submitted leaves no state.
        if record.jobs.is_empty() && !begun {
            return Ok(());
        }
        if !self.args.resume {
            return Err(has_rows(&self.out, RESUME_OR_FORCE));
        }
        if record.sweep != self.record.sweep {
            let help = "run with its original model and options, or restart with `--force`";
            let was = stored_model(&self.out, &record.sweep);
            let difference = project.sweep_mismatch(&self.record.sweep, &record.sweep, was.as_deref());
            return refusal(format!("it is of another sweep: {difference}"), help);
        }
        if self.args.on.shards.is_some_and(|requested| requested != record.shards) {
            let help = "omit `--shards` to continue with those, or restart with `--force`";
            return refusal(format!("its sweep has {} shards, not {}", record.shards, self.record.shards), help);
        }
        self.record = record;
        Ok(())
    }

    /// A folder without a record: it contains no job files, or those of a job to resume.
    fn check_unrecorded_folder(&mut self, plan: &SweepPlan) -> Result<(), Diagnostic> {
        if self.args.resume {
            let parts: Vec<PathBuf> = files::paths_in(&self.out.join("parts")).collect();
            if let (None, &[of]) = (self.args.on.shards, &shard_counts(&parts)[..]) {
                self.record.shards = of.clamp(1, plan.blocks().min(MOST_SHARDS));
            }
            return Ok(());
        }
        let names = ["shard.sh", self.queue.file, "parts", "logs"];
        if let Some(found) = names.map(|name| self.out.join(name)).iter().find(|path| path.symlink_metadata().is_ok()) {
            let message = format!(
                "`{}` is in the way: no `{RECORD}` in `{}` shows that kardan wrote it",
                found.display(),
                self.out.display()
            );
            let help =
                "move it away, or name another folder with --out DIR; if it is of this sweep, continue with `--resume`";
            return Err(Diagnostic::error("output::foreign-file", message).help(help));
        }
        if self.args.force { self.start_anew(0) } else { Ok(()) }
    }

    /// Removes the files of an earlier sweep with this number of shards: files that kardan wrote, and folders that become empty.
    fn start_anew(&self, shards: u64) -> Result<(), Diagnostic> {
        let why = "it is of an earlier sweep";
        ["parts", "logs"].iter().try_for_each(|name| stays(&self.out, &self.out.join(name)))?;
        let mut files = own_files(&self.out)?;
        let mut locks = Vec::new();
        for number in 1..=shards {
            self.files_of(number).iter().try_for_each(|path| stays(&self.out, path))?;
            if self.part(number).is_dir() {
                locks.push(Lock::take(&self.part(number), None)?);
            }
            files.extend(own_files(&self.part(number))?);
            files.extend(["sweep.html", "sweep.json"].map(|name| self.part(number).join(name)));
            files.extend(self.logs_of(number));
        }
        files.iter().try_for_each(|path| removed(path, why))?;
        locks.into_iter().for_each(Lock::remove);
        let parts = (1..=shards).map(|number| self.part(number));
        for folder in parts.chain(["parts", "logs"].map(|name| self.out.join(name))) {
            // A folder with foreign files stays.
            let _ = fs::remove_dir(folder);
        }
        Ok(())
    }

    /// Removes the manifests of incomplete shards, whose rows or manifest are damaged or missing. kardan recomputes them.
    fn undo_damaged(&self, (project, plan): (&Project, &SweepPlan)) -> Result<(), Diagnostic> {
        for number in self.all() {
            let (part, shard) = (self.part(number), self.shard(number));
            let manifest = path_of_manifest(&part, shard);
            if manifest.symlink_metadata().is_ok() && !is_whole(project, plan, &part, shard) {
                note(&format!(
                    "shard {number}: manifest or rows in `{}` are damaged or missing: it runs again",
                    part.display()
                ));
                removed(&manifest, "the shard is not done")?;
            }
        }
        Ok(())
    }

    fn save_record(&self) -> Result<(), Diagnostic> {
        save_in(&self.out, RECORD, self.record.to_text().as_bytes()).map(|_| ())
    }

    fn shard(&self, number: u64) -> Shard {
        Shard { number, of: self.record.shards }
    }

    /// The logs of a shard and its queue.
    fn logs_of(&self, number: u64) -> Vec<PathBuf> {
        LOGS.iter().map(|end| self.out.join("logs").join(format!("{number}.{end}"))).collect()
    }

    /// The folder of a shard, and its logs.
    fn files_of(&self, number: u64) -> Vec<PathBuf> {
        [vec![self.part(number)], self.logs_of(number)].concat()
    }

    fn all(&self) -> Vec<u64> {
        (1..=self.record.shards).collect()
    }

    fn part(&self, number: u64) -> PathBuf {
        self.out.join("parts").join(number.to_string())
    }

    /// The shards that are not done.
    fn missing(&self) -> Vec<u64> {
        self.all().into_iter().filter(|number| !self.is_done(*number)).collect()
    }

    fn is_done(&self, number: u64) -> bool {
        path_of_manifest(&self.part(number), self.shard(number)).is_file()
    }

    fn message(&self, text: &str) {
        if !self.quiet {
            note(text);
        }
    }

    /// Values of the words of a template, in a job that runs these shards.
    fn values(&self, shards: &[u64]) -> Result<Vec<(&'static str, String)>, Diagnostic> {
        let text = |path: &Path| match path.to_str() {
            Some(text) if !text.contains(|c: char| c.is_control()) => Ok(text.to_owned()),
            _ => {
                let why = "cannot be written into a script: it is not UTF-8 or has control characters";
                let message = format!("`{}` {why}", path.display());
                Err(Diagnostic::error("sweep::scheduler", message).help("give it another name"))
            }
        };
        let quoted = |path: &Path| Ok::<_, Diagnostic>(quoted_for_shell(&text(path)?));
        let own = std::env::current_exe().unwrap_or_else(|_| "kardan".into());
        let model = self.model_everywhere();
        let list: Vec<String> = shards.iter().map(u64::to_string).collect();
        let root = match model.parent() {
            Some(folder) if folder.as_os_str().is_empty() => self.out.as_path(),
            Some(folder) => self.out.ancestors().find(|above| folder.starts_with(above)).unwrap_or(&self.out),
            None => &self.out,
        };
        Ok(vec![
            ("shard", format!("sh {}", quoted(&self.out.join("shard.sh"))?)),
            ("array", ranges(shards)),
            ("list", list.join(" ")),
            ("count", shards.len().to_string()),
            ("shards", self.record.shards.to_string()),
            ("threads", threads(self.args).to_string()),
            ("processes", processes(self.args, shards.len() as u64).to_string()),
            ("retries", self.args.on.retries.to_string()),
            ("name", self.name()),
            ("out", quoted(&self.out)?),
            ("logs", quoted(&self.out.join("logs"))?),
            ("root", self.quoted_root(&text(root)?)?),
            ("kardan", quoted(&own)?),
            ("arguments", self.arguments(&text(&model)?)),
            ("version", env!("CARGO_PKG_VERSION").into()),
        ])
    }

    /// The folder above model and results as a word of a script; for Kubernetes one that YAML and a shell read the same way.
    fn quoted_root(&self, root: &str) -> Result<String, Diagnostic> {
        if self.queue.name != "kubernetes" {
            return Ok(quoted_for_shell(root));
        }
        match (root.contains(['$', '`', '\\', '"', '!']), root.contains('\'')) {
            (false, _) => Ok(format!("\"{root}\"")),
            (true, false) => Ok(format!("'{root}'")),
            (true, true) => {
                let message = format!("`{root}` has quotes that YAML and a shell read differently");
                Err(Diagnostic::error("sweep::scheduler", message).help("give that folder another name"))
            }
        }
    }

    /// The model as any folder has it: the name of a built-in one, or the path of the file from the root.
    fn model_everywhere(&self) -> PathBuf {
        let builtin = kardan::model::BUILTIN.iter().any(|builtin| self.model.as_os_str() == builtin.name);
        let path = if builtin { None } else { std::path::absolute(&self.model).ok() };
        path.unwrap_or_else(|| self.model.clone())
    }

    /// A name for the job, of lower-case letters, digits and dashes: of the model, the sweep in this folder, and its number.
    fn name(&self) -> String {
        let stem = self.model.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
        let stem: String = stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).take(30).collect();
        let out = self.out.to_string_lossy();
        let sum = [self.record.sweep.as_bytes(), out.as_bytes()].into_iter().fold(Random::FNV, Random::fnv);
        format!("kardan-{}-{:08x}-{}", stem.trim_matches('-'), sum >> 32, self.record.jobs.len() + 1)
    }

    /// Command of a shard, for a shell.
    fn arguments(&self, model: &str) -> String {
        let mut parts = vec!["sweep".to_string(), model.to_string()];
        let mut add =
            |option: &str, value: Option<String>| parts.extend(value.map(|value| format!("{option}={value}")));
        let args = self.args;
        add("--samples", args.samples.map(|n| n.to_string()));
        add("--seed", args.seed.map(|n| n.to_string()));
        args.variants.iter().for_each(|name| add("--variant", Some(name.clone())));
        args.changes.set.iter().for_each(|change| add("--set", Some(change.clone())));
        add("--method", word(args.method));
        add("--tolerance", args.tolerance.map(|x| format!("{x:e}")));
        add("--max-steps", Some(args.limits.max_steps.to_string()));
        if std::env::args_os().any(|word| word == "--portable") {
            parts.push("--portable".into());
        }
        parts.iter().map(|word| quoted_for_shell(word)).collect::<Vec<_>>().join(" ")
    }

    /// Writes the job that runs these shards: its path and its text.
    fn write_job(&self, shards: &[u64]) -> Result<(PathBuf, String), Diagnostic> {
        let text = fill(&self.template.0, &self.template.1, &self.values(shards)?)?;
        let path = save_in(&self.out, self.queue.file, text.as_bytes())?;
        Ok((path, text))
    }

    fn by_hand(&self, path: &Path) -> String {
        self.queue.by_hand(&quoted_for_shell(&path.to_string_lossy()))
    }

    /// Submits the shards and waits for the end of the job.
    fn run(&mut self, shards: &[u64]) -> Result<(), Diagnostic> {
        let (path, text) = self.write_job(shards)?;
        if let Some(program) = self.queue.missing(&text) {
            let message =
                format!("`{program}` is not installed: kardan wrote `{}` but did not submit it", path.display());
            let help = format!(
                "install {}; or submit it elsewhere with `{}`, and repeat the command with `--resume` when its shards have ended",
                self.queue.install,
                self.by_hand(&path)
            );
            return Err(Diagnostic::error("sweep::scheduler", message).help(help));
        }
        let (count, name) = (shards.len(), self.queue.name);
        if self.queue.submit.is_empty() {
            self.message(&format!("{count} shards run on {name}"));
            let started = started(&path);
            let mut child = started.map_err(|error| {
                let message = format!("cannot run `{}`: {}", path.display(), reason(&error));
                Diagnostic::error("sweep::scheduler", message).help(format!("install {}", self.queue.install))
            })?;
            let followed = self.follow(shards, &mut || Ok(child.try_wait().is_ok_and(|ended| ended.is_none())), true);
            if followed.is_err() {
                end(&mut child);
            }
            return followed;
        }
        let job = self.queue.submit(&path)?;
        self.message(&format!("{count} shards are job {job} of {name}"));
        self.record.jobs.push(format!("{name} {job}"));
        self.save_record()?;
        self.follow(shards, &mut || self.queue.contains(&job), false)
    }

    /// Follows the job of an earlier command, if it is still in this queue.
    fn go_on(&self, job: &str, missing: &[u64]) -> Result<(), Diagnostic> {
        let Some(job) = job.strip_prefix(self.queue.name).and_then(|job| job.strip_prefix(' ')) else { return Ok(()) };
        if self.queue.missing("").is_some() || self.queue.contains(job) == Ok(false) {
            return Ok(());
        }
        self.message(&format!("kardan follows job {job} of {}, {} shards are missing", self.queue.name, missing.len()));
        self.follow(missing, &mut || self.queue.contains(job), false)
    }

    /// Waits until all of the shards are done or their job has ended; reports progress.
    fn follow(
        &self,
        shards: &[u64],
        runs: &mut dyn FnMut() -> Result<bool, String>,
        own: bool,
    ) -> Result<(), Diagnostic> {
        let (mut reported, mut silent, mut wait) = (shards.len(), 0, POLL_INTERVALS.0);
        let mut next = Instant::now() + wait;
        loop {
            if stop::reason().is_some() {
                return Err(self.left());
            }
            if own && runs() == Ok(false) {
                return Ok(());
            }
            if Instant::now() < next {
                thread::sleep(SLICE);
                continue;
            }
            // The queue is polled before the folder, so that no shard ends between the two.
            let is_running = if own { Ok(true) } else { runs() };
            let missing = shards.iter().filter(|number| !self.is_done(**number)).count();
            if missing != reported {
                self.message(&format!(
                    "{} of {} shards are done",
                    self.record.shards - self.missing().len() as u64,
                    self.record.shards
                ));
                reported = missing;
            }
            match is_running {
                Ok(false) => return Ok(()),
                Ok(true) if missing == 0 && !own => return Ok(()),
                Ok(true) => silent = 0,
                Err(why) => {
                    silent += 1;
                    if silent == 1 {
                        self.message(&format!("{} does not answer ({why}): kardan retries", self.queue.name));
                    }
                    if silent > SILENCE {
                        let message = format!("{} no longer answers: {why}", self.queue.name);
                        let help = "its jobs continue; the same command with `--resume` follows them";
                        return Err(Diagnostic::error("sweep::job-queue", message).help(help));
                    }
                }
            }
            wait = wait.mul_f64(1.5).min(POLL_INTERVALS.1);
            next = Instant::now() + wait;
        }
    }

    /// The command ends before its jobs.
    fn left(&self) -> Diagnostic {
        let missing = self.missing().len();
        let help = match (self.queue.submit, self.record.jobs.last().and_then(|job| job.rsplit(' ').next())) {
            ([_, ..], Some(job)) => format!(
                "job {job} stays in the queue (`{} {job}` ends it); the same command with `--resume` follows it",
                self.queue.cancel
            ),
            _ => {
                "kardan stops its processes; the same command with `--resume` continues with the missing shards".into()
            }
        };
        Diagnostic::error("sweep::missing-shards", format!("{missing} of {} shards are missing", self.record.shards))
            .help(help)
    }

    /// Shards are missing after all tries.
    fn failed(&self, missing: &[u64]) -> Diagnostic {
        let mut message =
            format!("{} of {} shards are not done ({})", missing.len(), self.record.shards, ranges(missing));
        missing.iter().take(3).for_each(|number| {
            let _ = write!(message, "; shard {number}: {}", self.why(*number));
        });
        Diagnostic::error("sweep::shards", message).help(format!(
            "their last messages are in `{}`; after fixing the cause, the same command with `--resume` reruns only them",
            self.out.join("logs").display()
        ))
    }

    /// Why a shard is not done, as far as its log shows.
    fn why(&self, number: u64) -> String {
        let logs = self.logs_of(number);
        let read = |path: &PathBuf| files::read(path).map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        let error_line = logs.iter().filter_map(|path| read(path).ok()).find_map(|text| {
            let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
            // The first error, which may have further lines.
            let mut rest = lines.clone().skip_while(|line| !line.starts_with("× "));
            let error = rest.next().map(|first| {
                let more = rest.map_while(|line| line.strip_prefix("│ "));
                std::iter::once(first.trim_start_matches("× ")).chain(more).collect::<Vec<_>>().join(" ")
            });
            error
                .or_else(|| lines.next_back().map(String::from))
                .map(|error_line| error_line.chars().take(300).collect())
        });
        error_line.unwrap_or_else(|| match logs[0].exists() {
            true => "it ended without a message: killed or not finished".into(),
            false => "it has not started".into(),
        })
    }
}

/// An empty file gets a message about templates, not about models.
fn empty(diagnostic: Diagnostic) -> Diagnostic {
    match diagnostic.code {
        "file::empty" => diagnostic.help("start from kardan's template: `kardan sweep template slurm` prints one"),
        _ => diagnostic,
    }
}

/// Shards that run at the same time on this machine.
fn processes(args: &SweepArgs, shards: u64) -> u64 {
    let cores = thread::available_parallelism().map_or(1, |cores| cores.get() as u64);
    (cores / threads(args)).clamp(1, shards.max(1))
}

/// Threads of a shard.
fn threads(args: &SweepArgs) -> u64 {
    args.threads.unwrap_or(1)
}

/// Starts a script in its own process group: kardan forwards signals of the terminal to it.
fn started(path: &Path) -> std::io::Result<Child> {
    let mut command = Command::new("sh");
    command.arg(path).stdin(Stdio::null()).stdout(Stdio::null());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn()
}

/// Ends a script and all its processes with SIGTERM, so that shards write their blocks.
fn end(child: &mut Child) {
    let group = format!("-{}", child.id());
    let _ = Command::new("kill").args(["-TERM", "--", &group]).stdin(Stdio::null()).stderr(Stdio::null()).status();
    let begun = Instant::now();
    while child.try_wait().is_ok_and(|ended| ended.is_none()) && begun.elapsed() < GRACE {
        thread::sleep(SLICE);
    }
    let _ = child.kill();
    let _ = child.wait();
}
