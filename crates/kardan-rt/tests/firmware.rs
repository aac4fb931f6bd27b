//! The blocks without std: firmware in small links only where no path leads to a panic.
//!
//! A test binary of its own: it runs cargo, for minutes where nothing is built yet, and needs nothing of the other tests.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const MISSING: &str = "kardan_rt_has_a_panic_path";

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware")
}

/// Builds it in its own folder, as a user would; what cargo says.
fn build(arguments: &[&str]) -> Output {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--release", "--locked", "--target-dir"]).arg(env!("CARGO_TARGET_TMPDIR"));
    // Flags of an outer build are not its own.
    for inherited in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "RUSTC_WRAPPER", "RUSTC_WORKSPACE_WRAPPER"] {
        cargo.env_remove(inherited);
    }
    cargo.args(arguments).current_dir(folder()).output().expect("cargo runs")
}

fn stderr_text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Whether the standard `core` of a target is installed.
fn installed(target: &str) -> bool {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let found = Command::new(rustc).args(["--print", "sysroot"]).output().expect("rustc runs");
    let root = String::from_utf8_lossy(&found.stdout).trim().to_string();
    Path::new(&root).join("lib/rustlib").join(target).is_dir()
}

#[test]
fn no_path_of_any_block_leads_to_a_panic() {
    let good = build(&[]);
    assert!(good.status.success(), "a block may panic, or does not build without std:\n{}", stderr_text(&good));
    // The same check notices a single index.
    let bad = build(&["--features", "a_panic_path"]);
    assert!(!bad.status.success() && stderr_text(&bad).contains(MISSING), "{}", stderr_text(&bad));
}

#[test]
fn no_path_leads_to_a_panic_on_a_microcontroller() {
    let target = "thumbv7em-none-eabihf";
    if !installed(target) {
        println!("not checked: {target} is not installed (rustup target add {target})");
        return;
    }
    let good = build(&["--target", target]);
    assert!(good.status.success(), "a block may panic, or does not build for {target}:\n{}", stderr_text(&good));
    let bad = build(&["--target", target, "--features", "a_panic_path"]);
    assert!(!bad.status.success() && stderr_text(&bad).contains(MISSING), "{}", stderr_text(&bad));
}
