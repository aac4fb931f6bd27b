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
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ' ' if !quoted => words.push(String::new()),
            c => words.last_mut().unwrap().push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

#[test]
fn every_command_of_the_readme_runs() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("readme");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let mut count = 0;
    for line in readme().lines().filter(|line| line.starts_with("    ")).map(str::trim) {
        let words = words(line);
        let arguments = match words.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
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
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap_or_default();
            let there = link.contains("://") || file.is_empty() || page.with_file_name(file).exists();
            assert!(there, "{}: {link} leads nowhere", page.display());
        }
    }
}

/// The model of the first steps is one.
#[test]
fn the_first_model_has_no_mistakes() {
    let text = fs::read_to_string(root().join("docs/first-model.md")).unwrap();
    let model = text.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let mistakes = kardan::study::check(model);
    assert!(mistakes.is_empty(), "{mistakes:?}");
}
