//! Tests of `src/output.rs`.

use super::*;

#[test]
fn quoted_arguments_are_one_shell_word() {
    for (text, word) in [
        ("/a/b-1.toml", "/a/b-1.toml"),
        ("", "''"),
        ("a b", "'a b'"),
        ("it's $x", "'it'\\''s $x'"),
        ("=ls", "'=ls'"),
        ("a[0]=~", "'a[0]=~'"),
    ] {
        assert_eq!(quoted_for_shell(text), word);
    }
}

#[test]
fn leftovers_are_recognised_by_their_names() {
    assert!(is_part(".kardan-1-0.part") && is_part(".kardan-4711-12.part"));
    for name in [
        ".kardan--0.part",
        ".kardan-1.part",
        ".kardan-1-0-0.part",
        "kardan-1-0.part",
        ".kardan-1-0.partial",
        ".a.1-0.part",
    ] {
        assert!(!is_part(name), "{name}");
    }
}

/// A file that a process is writing stays; a leftover is removed.
#[test]
fn only_leftovers_are_removed() {
    let folder = std::env::temp_dir().join(format!("kardan-sweep-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let leftover = folder.join(".kardan-1-0.part");
    fs::write(&leftover, "half").unwrap();
    fs::write(folder.join("model.part"), "mine").unwrap();
    let living = Part::create(&folder, None).unwrap();
    sweep(&folder);
    assert!(!leftover.exists() && living.path.exists() && folder.join("model.part").exists());
    drop(living);
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
    fs::remove_dir_all(&folder).unwrap();
}
