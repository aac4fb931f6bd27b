//! `kardan completions`: a completion script.

use clap::CommandFactory;

use crate::args::{Cli, CompletionsArgs};
use crate::exit::DONE;
use crate::output::print;
use crate::render::Failure;

pub fn completions(args: &CompletionsArgs) -> Result<u8, Failure> {
    let mut script = Vec::new(); // the generator panics on a closed pipe
    clap_complete::generate(args.shell, &mut Cli::command(), "kardan", &mut script);
    print(&String::from_utf8_lossy(&script))?;
    Ok(DONE)
}
