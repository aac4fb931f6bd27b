//! Every command of the README runs, in its order; it is short, and its links lead somewhere.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn readme() -> String {
    fs::read_to_string(root().join("README.md")).unwrap()
}

/// The words of a line as a shell has them: parts in double quotes are one.
fn tokens(line: &str) -> Vec<String> {
    let mut tokens = vec![String::new()];
    let mut quoted = false;
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ' ' if !quoted => tokens.push(String::new()),
            c => tokens.last_mut().unwrap().push(c),
        }
    }
    tokens.retain(|word| !word.is_empty());
    tokens
}

#[test]
fn every_command_of_the_readme_runs() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("readme");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let mut count = 0;
    for line in readme().lines().filter(|line| line.starts_with("    ")).map(str::trim) {
        let tokens = tokens(line);
        let arguments = match tokens.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
            ["kardan", arguments @ ..] | ["cargo", "run", "--release", "--", arguments @ ..] => {
                arguments.iter().map(ToString::to_string).collect::<Vec<_>>()
            }
            // Tests do not build and do not run the tests; what these name is there.
            ["cargo", "install", "--path", path] => {
                assert!(root().join(path).join("Cargo.toml").is_file(), "{line}");
                continue;
            }
            ["cargo", "test", "--workspace"] => continue,
            _ => panic!("not a command that this test knows: {line}"),
        };
        let got = Command::new(env!("CARGO_BIN_EXE_kardan"))
            .current_dir(&folder)
            .args(&arguments)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        assert_eq!(got.status.code(), Some(0), "{line}: {}", String::from_utf8_lossy(&got.stderr));
        assert!(!got.stdout.is_empty() || line.contains("--write"), "{line} prints nothing");
        count += 1;
    }
    assert!(count > 10, "{count}");
    for file in ["my.toml", "kardan-out/report.html", "structure.html", "design.html", "bench/truth.toml"] {
        assert!(folder.join(file).is_file(), "{file} is not there");
    }
}

#[test]
fn the_readme_is_short_and_its_links_lead_somewhere() {
    let text = readme();
    assert!(text.split_whitespace().count() <= 700, "{} words", text.split_whitespace().count());
    let mut pages = vec![root().join("README.md")];
    pages.extend(fs::read_dir(root().join("docs")).unwrap().flatten().map(|entry| entry.path()));
    for page in pages.iter().filter(|page| page.extension().is_some_and(|extension| extension == "md")) {
        let text = fs::read_to_string(page).unwrap();
        for link in text.split("](").skip(1).filter_map(|tail| tail.split(')').next()) {
            let file = link.split('#').next().unwrap_or_default();
            let exists = link.contains("://") || file.is_empty() || page.with_file_name(file).exists();
            assert!(exists, "{}: {link} leads nowhere", page.display());
        }
    }
}

/// The model of the first steps is one, and the commands below it work as they are printed; the last one waits for changes.
#[test]
#[cfg(unix)]
fn the_first_steps_work_as_printed() {
    let text = fs::read_to_string(root().join("docs/first-model.md")).unwrap();
    let model = text.split("```toml\n").nth(1).and_then(|tail| tail.split("```").next()).unwrap();
    let diagnostics = kardan::study::check(model);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("first-model");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("arm.toml"), model).unwrap();
    let kardan = Path::new(env!("CARGO_BIN_EXE_kardan")).parent().unwrap();
    let path = format!("{}:{}", kardan.display(), std::env::var("PATH").unwrap());
    let lines: Vec<String> = shell_lines(&text).into_iter().filter(|line| !line.contains("--watch")).collect();
    assert!(lines[0].starts_with("kardan check") && lines.len() == 3, "{lines:?}");
    for shell in ["sh", "zsh"] {
        for line in &lines {
            let mut command = Command::new(shell);
            command.args(["-c", line]).current_dir(&folder).env("PATH", &path).stdin(Stdio::null());
            // Not everybody has zsh.
            let Ok(got) = command.output() else { continue };
            assert_eq!(got.status.code(), Some(0), "{shell}: {line}: {}", String::from_utf8_lossy(&got.stderr));
        }
    }
}

/// Lines of a page that are typed into a shell.
fn shell_lines(text: &str) -> Vec<String> {
    let programs = ["kardan ", "cargo ", "python3 "];
    let lines = text.lines().filter(|line| line.starts_with("    ")).map(|line| line.trim().trim_start_matches("$ "));
    lines.filter(|line| programs.iter().any(|program| line.starts_with(program))).map(String::from).collect()
}

/// What zsh, typed into, takes otherwise than sh in a command: comments, brackets, braces, `!`, and `=` that begins a word. `*` is meant where it stands for files.
fn differs_in_zsh(line: &str) -> Option<String> {
    let (mut quote, mut before) = (None, ' ');
    let wrong = |c: char| Some(format!("`{c}` outside of quotes"));
    for c in line.chars() {
        match (quote, c) {
            (None, '\'' | '"') => quote = Some(c),
            (Some(open), c) if c == open => quote = None,
            (Some('"'), '!' | '$' | '`') => return Some(format!("`{c}` in double quotes")),
            (None, '#' | '[' | ']' | '{' | '}' | '(' | ')' | '!' | '?' | '^') => return wrong(c),
            (None, '=') if before == ' ' => return wrong(c),
            _ => {}
        }
        before = c;
    }
    quote.map(|open| format!("`{open}` is not closed"))
}

/// Commands of the README, of all pages and of the help mean the same in sh, bash and zsh.
#[test]
fn every_command_means_the_same_in_zsh() {
    for (line, wrong) in [
        ("kardan check arm.toml   # all", true),
        ("kardan run m.toml --set a[0].to=1", true),
        ("kardan run m.toml --set \"a[0].to=1\"", false),
        ("kardan run m.toml --set 'a=!x'", false),
        ("kardan run m.toml --set \"a=!x\"", true),
        ("kardan run =m.toml", true),
        ("kardan sweep merge m.toml parts/* --out all", false),
        ("kardan run 'm.toml", true),
    ] {
        assert_eq!(differs_in_zsh(line).is_some(), wrong, "{line}");
    }
    let pages = fs::read_dir(root().join("docs")).unwrap().flatten().map(|entry| entry.path());
    let pages = pages.filter(|path| path.extension().is_some_and(|extension| extension == "md"));
    let mut lines = Vec::new();
    for page in pages.chain([root().join("README.md"), root().join("ARCHITECTURE.md")]) {
        let text = fs::read_to_string(&page).unwrap();
        let inline = text.split('`').skip(1).step_by(2).filter(|code| code.starts_with("kardan ")).map(String::from);
        lines.extend(shell_lines(&text).into_iter().chain(inline).map(|line| (page.display().to_string(), line)));
    }
    let help = |arguments: &[&str]| {
        let got = Command::new(env!("CARGO_BIN_EXE_kardan")).args(arguments).arg("--help").output().unwrap();
        String::from_utf8(got.stdout).unwrap()
    };
    let all = help(&[]);
    let commands = all.split("Commands:").nth(1).unwrap().lines().skip(1).take_while(|line| !line.trim().is_empty());
    let commands: Vec<&str> = commands.filter_map(|line| line.split_whitespace().next()).collect();
    assert!(commands.contains(&"sweep") && commands.contains(&"run"), "{commands:?}");
    for command in commands.into_iter().filter(|command| *command != "help") {
        let text = help(&[command]);
        let examples = text.lines().map(str::trim).filter(|line| line.starts_with("kardan "));
        lines.extend(examples.map(|line| (format!("{command} --help"), line.to_string())));
    }
    assert!(lines.len() > 100, "{}", lines.len());
    let wrong = lines.iter().filter_map(|(whose, line)| Some(format!("{whose}: {line}: {}", differs_in_zsh(line)?)));
    let wrong: Vec<String> = wrong.collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
