//! `kardan completions`: a completion script, which knows the built-in models.

use clap::builder::PossibleValuesParser;
use clap::{Command, CommandFactory};
use clap_complete::Shell;
use kardan::export;
use kardan::model::BUILTIN;

use crate::args::{Cli, CompletionsArgs};
use crate::exit::done;
use crate::render::Failure;

pub fn completions(args: &CompletionsArgs) -> Result<u8, Failure> {
    let mut script = Vec::new(); // the generator panics on a closed pipe
    clap_complete::generate(args.shell, &mut with_models(Cli::command()), "kardan", &mut script);
    let script = finished(args.shell, &String::from_utf8_lossy(&script));
    match args.json {
        true => done(&(export::completions_json(&args.shell.to_string(), &script) + "\n")),
        false => done(&script),
    }
}

fn names() -> impl Iterator<Item = &'static str> {
    BUILTIN.iter().map(|builtin| builtin.name)
}

/// The arguments that name a model, with the built-in ones as their values.
fn with_models(command: Command) -> Command {
    command.mut_subcommands(|command| match model_argument(&command) {
        Some(argument) => command.mut_arg(argument, |one| one.value_parser(PossibleValuesParser::new(names()))),
        None => command,
    })
}

/// The argument of a command that names a model.
fn model_argument(command: &Command) -> Option<&'static str> {
    let argument = if command.get_name() == "models" { "name" } else { "model" };
    command.get_arguments().any(|one| one.get_id() == argument).then_some(argument)
}

/// A model argument also accepts a file.
fn finished(shell: Shell, script: &str) -> String {
    let list = names().collect::<Vec<_>>().join(" ");
    match shell {
        Shell::Zsh => {
            let models = format!(
                "_kardan_models() {{\n    _alternative 'models:built-in model:({list})' 'files:model file:_files'\n}}\n\n"
            );
            let script = script.replace(&format!(":({list})"), ":_kardan_models");
            // The function is placed before the first one of the script.
            match script.find("_kardan() {") {
                Some(at) => [&script[..at], &models, &script[at..]].concat(),
                None => script,
            }
        }
        Shell::Fish => {
            let used = "__fish_kardan_using_subcommand";
            let commands = Cli::command();
            let commands = commands.get_subcommands().filter(|command| model_argument(command).is_some());
            let lines = commands.map(|command| {
                format!("complete -c kardan -n \"{used} {}\" -a \"{list}\" -d 'Built-in model'\n", command.get_name())
            });
            script.to_string() + &lines.collect::<String>()
        }
        _ => script.to_string(),
    }
}
