//! Files of a sweep in a folder: rows, block by block, the manifest of a shard, the model. Which files exist, whether they are undamaged, and which of them kardan removes.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use kardan::diagnostics::Diagnostic;
use kardan::export::{self, RowsError};
use kardan::project::Project;
use kardan::results::{SweepRow, SweepRows};
use kardan::study::{Shard, SweepPlan};

use super::model_store::{models_of, path_of_model, stored_model};
use crate::args::SweepArgs;
use crate::files::{self, reason};
use crate::output::save_in;
use crate::render::note;

/// Names of files of rows.
const STEM: &str = "rows-";
/// Metadata key of every file of rows.
const MARK: &[u8] = b"kardan:sweep";
/// How the manifest of a shard begins.
const MANIFEST: &str = "{\"sweep\":\"kardan ";

/// Files of rows in the folder, by their blocks.
pub fn files_of_rows(out: &Path) -> Vec<(u64, PathBuf)> {
    let block = |path: PathBuf| {
        let name = files::name_in_folder(&path);
        let block = name.strip_prefix(STEM)?.strip_suffix(".parquet")?.parse().ok()?;
        (name == name_of(block)).then_some((block, path))
    };
    let mut found: Vec<(u64, PathBuf)> = files::paths_in(out).filter_map(block).collect();
    found.sort();
    found
}

/// The name of a block's file.
fn name_of(block: u64) -> String {
    format!("{STEM}{block:06}.parquet")
}

/// Writes a block; after the first one of a restarted sweep, removes those of another sweep.
pub fn write_block(out: &Path, plan: &SweepPlan, block: u64, rows: &[SweepRow], first: bool) -> Result<(), Diagnostic> {
    let bytes = export::sweep_rows(&plan.head, rows)
        .map_err(|error| Diagnostic::error("output::folder", format!("rows cannot be written as Parquet: {error}")))?;
    save_in(out, &name_of(block), &bytes)?;
    if first { start_anew(out, plan, block) } else { Ok(()) }
}

/// The manifest of a shard, beside its rows.
pub fn write_manifest(
    out: &Path,
    (plan, shard): (&SweepPlan, Shard),
    rows: u64,
    seconds: f64,
) -> Result<(), Diagnostic> {
    let threads = rayon::current_num_threads();
    let text = format!("{}{rows},\"seconds\":{seconds:.3},\"threads\":{threads}}}\n", manifest_start(plan, shard));
    save_in(out, &name_of_manifest(shard), text.as_bytes()).map(|_| ())
}

/// The description of the sweep in the manifest of a shard, before its counts.
fn manifest_start(plan: &SweepPlan, shard: Shard) -> String {
    let samples = plan.samples_of(blocks_of(plan, shard));
    let identity = plan.head.identity.replace('\\', "\\\\").replace('"', "\\\"");
    let Shard { number, of } = shard;
    format!(
        "{{\"sweep\":\"{identity}\",\"shard\":{number},\"shards\":{of},\"first_sample\":{},\"samples\":{},\"rows\":",
        samples.start,
        samples.end - samples.start
    )
}

/// The blocks of a shard.
pub fn blocks_of(plan: &SweepPlan, shard: Shard) -> Range<u64> {
    let mut part = plan.clone();
    part.shard = Some(shard);
    part.own_blocks()
}

/// The name of the manifest of a shard, which exists once the shard is done.
fn name_of_manifest(Shard { number, of }: Shard) -> String {
    format!("shard-{number}-of-{of}.json")
}

/// The path of the manifest of a shard.
pub fn path_of_manifest(out: &Path, shard: Shard) -> PathBuf {
    out.join(name_of_manifest(shard))
}

/// Whether a shard is done: its manifest exists and is of this sweep, and so are all its rows, undamaged.
pub fn is_whole(project: &Project, plan: &SweepPlan, out: &Path, shard: Shard) -> bool {
    let manifest = files::read_text(&path_of_manifest(out, shard)).unwrap_or_default();
    manifest.starts_with(&manifest_start(plan, shard))
        && blocks_of(plan, shard).all(|block| rows_of(project, plan, block, &out.join(name_of(block))).is_ok())
}

/// The number of shards of a sweep, from the manifests in folders.
pub fn shard_counts(folders: &[PathBuf]) -> Vec<u64> {
    let count = |path: PathBuf| -> Option<u64> {
        let name = files::name_in_folder(&path);
        let (_, of) = name.strip_prefix("shard-")?.strip_suffix(".json")?.split_once("-of-")?;
        of.parse().ok()
    };
    let mut counts: Vec<u64> = folders.iter().flat_map(|part| files::paths_in(part)).filter_map(count).collect();
    counts.sort_unstable();
    counts.dedup();
    counts
}

/// Why rows of a block cannot be used.
pub struct Unusable {
    /// As text.
    pub why: String,
    /// They are damaged; else they are of another sweep.
    pub is_damaged: bool,
}

impl Unusable {
    fn damaged(why: impl Into<String>) -> Self {
        Self { why: why.into(), is_damaged: true }
    }
}

/// The rows of a block: all of them, of this sweep.
pub fn rows_of(project: &Project, plan: &SweepPlan, block: u64, path: &Path) -> Result<Vec<SweepRow>, Unusable> {
    let bytes = files::read(path).map_err(|error| Unusable::damaged(reason(&error)))?;
    let found = export::read_sweep_rows(&plan.head, bytes).map_err(|error| match error {
        RowsError::Damaged(why) => Unusable::damaged(why),
        RowsError::SweepMismatch(identity) => {
            let was = path.parent().and_then(|folder| stored_model(folder, &identity));
            let differs = project.sweep_mismatch(&plan.head.identity, &identity, was.as_deref());
            Unusable { why: format!("it is of another sweep: {differs}"), is_damaged: false }
        }
    })?;
    let samples = plan.samples_of(block..block.saturating_add(1));
    let own = found.iter().filter(|row| samples.contains(&row.sample)).count();
    match own == found.len() && own == samples.count() * plan.head.variants.len() {
        true => Ok(found),
        false => Err(Unusable::damaged("it does not contain all rows of its block")),
    }
}

/// The existing rows of the same sweep; a folder with those of another one is rejected. Blocks with damaged files are left out and reported;
/// kardan recomputes them.
pub fn rows_before(
    args: &SweepArgs,
    out: &Path,
    (project, plan): (&Project, &SweepPlan),
) -> Result<SweepRows, Diagnostic> {
    let mut files = files_of_rows(out);
    if plan.shard.is_some() {
        // Shards may fill one folder.
        files.retain(|(block, _)| plan.own_blocks().contains(block));
    }
    if !args.resume {
        if args.force {
            own_files(out)?;
            return Ok(SweepRows::default());
        }
        if !files.is_empty() {
            return Err(has_rows(out, RESUME_OR_FORCE));
        }
        let page = out.join("sweep.html");
        if plan.shard.is_none() && page.exists() {
            let message = format!("`{}` already exists, without rows of a sweep", page.display());
            let help = "replace it with `--force`, or name another folder with --out DIR";
            return Err(Diagnostic::error("output::folder", message).help(help));
        }
        return Ok(SweepRows::default());
    }
    let mut rows = SweepRows::default();
    for (block, path) in files {
        match rows_of(project, plan, block, &path) {
            Ok(found) => rows.extend(found),
            Err(found) if found.is_damaged && plan.own_blocks().contains(&block) => {
                note(&format!("`{}`: {}; kardan recomputes its rows", path.display(), found.why));
            }
            Err(found) => {
                let message = format!("kardan cannot resume `{}`: {}", path.display(), found.why);
                let help = "run with its original model and options, remove it to rerun its samples, or restart with `--force`";
                return Err(Diagnostic::error("sweep::resume", message).help(help));
            }
        }
    }
    Ok(rows)
}

/// Help for a folder whose rows the command may continue.
pub const RESUME_OR_FORCE: &str =
    "continue with `--resume`, replace them with `--force`, or name another folder with --out DIR";

/// The folder already has rows.
pub fn has_rows(out: &Path, help: &str) -> Diagnostic {
    let message = format!("the folder `{}` already contains rows of a sweep", out.display());
    Diagnostic::error("output::folder", message).help(help)
}

/// Files of a sweep in a folder that kardan has written: rows, manifests, models.
///
/// # Errors
/// A file with the name of one that kardan did not write: only its owner can decide whether to remove it.
pub fn own_files(out: &Path) -> Result<Vec<PathBuf>, Diagnostic> {
    let is_manifest = |path: &Path| files::read(path).is_ok_and(|bytes| bytes.starts_with(MANIFEST.as_bytes()));
    let manifests = files::paths_in(out).filter(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("shard-") && name.contains("-of-") && name.ends_with(".json")
    });
    let rows = files_of_rows(out).into_iter().map(|(_, path)| (is_rows(&path), path));
    let all = rows.chain(manifests.map(|path| (is_manifest(&path), path)));
    let foreign = |path: &Path| {
        let message = format!("`{}` has the name of a sweep file, but kardan did not write it", path.display());
        let help =
            "move it away, or name another folder with --out DIR: `--force` removes only files that kardan wrote";
        Diagnostic::error("output::foreign-file", message).help(help)
    };
    let mut own =
        all.map(|(own, path)| if own { Ok(path) } else { Err(foreign(&path)) }).collect::<Result<Vec<_>, _>>()?;
    own.extend(models_of(out));
    Ok(own)
}

/// Whether kardan wrote a file of rows, even if it was damaged since.
fn is_rows(path: &Path) -> bool {
    let bytes = files::read(path).unwrap_or_default();
    bytes.starts_with(b"PAR1") && bytes.windows(MARK.len()).any(|window| window == MARK)
}

/// Removes files of rows with higher numbers than those of a complete sweep: they are of another one, whose other files were replaced.
pub fn put_away(out: &Path, blocks: u64) -> Result<(), Diagnostic> {
    let mut behind = files_of_rows(out).into_iter().filter(|(block, path)| *block >= blocks && is_rows(path));
    behind.try_for_each(|(_, path)| removed(&path, "it contains rows of another sweep"))
}

/// Removes rows of another sweep once this one has written its first block: if it ends early, all rows are of one sweep. For a shard: its own part, and
/// rows that no shard of this sweep has.
fn start_anew(out: &Path, plan: &SweepPlan, saved_block: u64) -> Result<(), Diagnostic> {
    if let Some(shard) = plan.shard {
        removed(&path_of_manifest(out, shard), "it is of an earlier sweep")?;
    }
    if plan.shard.is_none() {
        let own = path_of_model(out, &plan.head.identity);
        let mut old = models_of(out).into_iter().filter(|path| *path != own);
        old.try_for_each(|path| removed(&path, "it is the model of an earlier sweep"))?;
    }
    let own = |block: u64| block != saved_block && (plan.own_blocks().contains(&block) || block >= plan.blocks());
    let mut old = files_of_rows(out).into_iter().filter(|(block, _)| own(*block));
    old.try_for_each(|(_, path)| removed(&path, "it contains rows of another sweep"))
}

/// Removes a file, if it exists.
pub fn removed(path: &Path, why: &str) -> Result<(), Diagnostic> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            let message = format!("cannot remove `{}`: {}", path.display(), reason(&error));
            Err(Diagnostic::error("output::folder", message).help(format!("remove it: {why}")))
        }
        _ => Ok(()),
    }
}
