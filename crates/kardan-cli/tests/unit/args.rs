//! Tests of `src/args/mod.rs`.

use clap::{CommandFactory, Parser};

use super::{Cli, Command};

#[test]
fn the_command_line_is_consistent() {
    Cli::command().debug_assert();
}

#[test]
fn a_controller_is_either_in_the_file_or_fully_specified() {
    let parse = |line: &str| Cli::try_parse_from(line.split(' '));
    for good in [
        "kardan design",
        "kardan design a.toml --control column --feedback block --no-simulation",
        "kardan design a.toml --inputs a,b --outputs x.phi,y.phi",
        "kardan design --law decoupling",
        "kardan design --outputs x.phi",
        "kardan design a.toml --law lqr --inputs a --outputs x.phi --controller c.json --report r.html --json",
    ] {
        assert!(parse(good).is_ok(), "{good}");
    }
    for bad in ["kardan design --control c --inputs a --outputs x.phi", "kardan design --feedback none"] {
        assert!(parse(bad).is_err(), "{bad}");
    }
    let Ok(Cli { command: Command::Design(args), .. }) = parse("kardan design --inputs a,b --outputs x,y") else {
        panic!("a design")
    };
    assert_eq!((args.inputs.len(), args.outputs.len(), args.model.to_str()), (2, 2, Some("sia-steering")));
}

/// Random arguments: known words, values, parts of them and noise, in any order. Each list is accepted, or rejected with a message.
#[test]
fn random_arguments_are_accepted_or_refused() {
    let command = Cli::command();
    let mut tokens: Vec<String> =
        vec!["-".into(), "--".into(), "=".into(), "-q".into(), String::new(), "\u{0}\u{fffd}".into()];
    for sub in command.get_subcommands() {
        tokens.push(sub.get_name().into());
        for argument in sub.get_arguments() {
            tokens.extend(argument.get_long().map(|long| format!("--{long}")));
            tokens.extend(argument.get_short().map(|short| format!("-{short}")));
            tokens.extend(argument.get_possible_values().iter().map(|value| value.get_name().to_string()));
        }
    }
    tokens.extend(
        [
            "1",
            "-1",
            "0",
            "1e999",
            "NaN",
            "20%",
            "1 ms",
            "1e-400 s",
            "sia-steering",
            "rk.phi",
            "a=b",
            "18446744073709551616",
            "\u{3bc}s",
        ]
        .map(String::from),
    );
    let mut state = 5u64;
    let mut below = |bound: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % bound
    };
    let (mut accepted, mut refused) = (0, 0);
    for _ in 0..40_000 {
        let mut arguments = vec!["kardan".to_string()];
        for _ in 0..below(7) {
            let mut word = tokens[below(tokens.len())].clone();
            match below(8) {
                0 => word = format!("{word}={}", tokens[below(tokens.len())]),
                1 => word = word.chars().take(below(6)).collect(),
                2 => word.push_str(&tokens[below(tokens.len())]),
                _ => {}
            }
            arguments.push(word);
        }
        match Cli::try_parse_from(&arguments) {
            Ok(_) => accepted += 1,
            Err(usage) => {
                assert!(!usage.to_string().trim().is_empty(), "{arguments:?} is refused without a word");
                refused += 1;
            }
        }
    }
    assert!(accepted > 100 && refused > 5000, "{accepted} taken, {refused} refused");
}
