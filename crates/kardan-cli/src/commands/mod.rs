//! One file for each command; this module dispatches them and reports errors.

mod analyze;
mod bench;
mod check;
mod cluster;
mod completions;
mod design;
mod elements;
mod equations;
mod identify;
mod linearise;
mod model_store;
mod models;
mod rerun;
mod rows;
mod run;
mod run_files;
mod safety;
mod schema;
mod sweep;

use std::ffi::OsString;

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Parser};
use kardan::diagnostics::{Diagnostic, nearest};

use crate::args::{Cli, Command, Common, SweepArgs, SweepCommand};
use crate::exit::{DONE, ERROR, exit_code};
use crate::output::print;
use crate::panics;
use crate::render::Failure;
use crate::{stop, watch};

/// Runs the command of the arguments (with the program's name first), and returns the exit code.
pub fn main(arguments: Vec<OsString>) -> u8 {
    let is_json = arguments.iter().any(|argument| argument == "--json");
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(usage) => {
            let usage = with_nearest_command(usage);
            if is_json && usage.use_stderr() {
                let _ = print(&(kardan::export::json_error(usage.to_string().trim(), "", &[]) + "\n"));
            }
            let _ = usage.print();
            return if usage.use_stderr() { ERROR } else { DONE };
        }
    };
    let Common { json, limits, model } = cli.command.common();
    stop::listen(json);
    panics::install(json);
    if cli.portable {
        kardan_native::switch_off();
    }
    if let Some(seconds) = limits.and_then(|limits| limits.time_limit) {
        stop::limit(seconds);
    }
    if let Some(refusal) = unwatchable(&cli.command).or_else(|| limit_threads(&cli.command).err()) {
        return exit_code(Err(refusal.into()), json);
    }
    match model.filter(|(_, changes)| changes.watch) {
        None => exit_code(dispatch(&cli), json),
        Some((model, _)) => watch::again_and_again(model, cli.quiet, json, || exit_code(dispatch(&cli), json)),
    }
}

/// Why a command is not repeated when its file changes: rows of a changed model belong to another sweep.
fn unwatchable(command: &Command) -> Option<Diagnostic> {
    let Command::Sweep(args) = command else { return None };
    let keeps = args.changes.watch && args.out.is_some() && !args.force;
    let message = "`--watch` with `--out`: when the file changes, the existing rows are of another sweep";
    let help = "add `--force`, so that each pass replaces the rows of the previous one, or omit `--out`";
    keeps.then(|| Diagnostic::error("arguments::watch", message).help(help))
}

/// Starts as many threads as a sweep on this machine requests, before any other code starts threads.
fn limit_threads(command: &Command) -> Result<(), Diagnostic> {
    let Command::Sweep(SweepArgs { threads: Some(threads), on, .. }) = command else { return Ok(()) };
    if on.on.is_some() {
        return Ok(());
    }
    let count = usize::try_from(*threads).unwrap_or(usize::MAX);
    rayon::ThreadPoolBuilder::new().num_threads(count).build_global().map_err(|error| {
        let message = format!("`--threads {threads}`: the threads cannot be started: {error}");
        Diagnostic::error("arguments::threads", message).help("request fewer, or omit `--threads`")
    })
}

/// Adds the probably intended command, where a short word is too far from it for the argument parser.
fn with_nearest_command(mut usage: clap::Error) -> clap::Error {
    let word = match usage.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(word)) if usage.get(ContextKind::SuggestedSubcommand).is_none() => word.clone(),
        _ => return usage,
    };
    let commands = Cli::command();
    if let Some(near) = nearest(&word, commands.get_subcommands().map(clap::Command::get_name)) {
        let near = ContextValue::Strings(vec![near.to_owned()]);
        usage.insert(ContextKind::SuggestedSubcommand, near);
    }
    usage
}

fn dispatch(cli: &Cli) -> Result<u8, Failure> {
    match &cli.command {
        Command::Run(args) => run::run(args, cli.quiet),
        Command::Analyze(args) => analyze::analyze(args, cli.quiet),
        Command::Design(args) => design::design(args, cli.quiet),
        Command::Identify(args) => identify::identify(args, cli.quiet),
        Command::Bench(args) => bench::bench(args, cli.quiet),
        Command::Safety(args) => safety::safety(args, cli.quiet),
        Command::Sweep(SweepArgs { merge: Some(SweepCommand::Template(args)), .. }) => cluster::print_template(args.on),
        Command::Sweep(args) => match args.on.on {
            Some(target) => cluster::sweep(args, target, cli.quiet),
            None => sweep::sweep(args, cli.quiet),
        },
        Command::Equations(args) => equations::equations(args, cli.quiet),
        Command::Linearise(args) => linearise::linearise(args, cli.quiet),
        Command::Check(args) => check::check(args, cli.quiet),
        Command::Models(args) => models::models(args, cli.quiet),
        Command::Elements(args) => elements::elements(args),
        Command::Schema(args) => schema::schema(args),
        Command::Completions(args) => completions::completions(args),
    }
}
