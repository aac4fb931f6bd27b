//! Tests of `src/folder.rs`.

use super::*;

#[test]
fn names_are_safe_and_different() {
    let mut folder = Folder { path: PathBuf::new(), used_names: HashSet::new(), saved_files: Vec::new() };
    let names = ["β=10°", "../../etc/passwd", "", "..", "A", "a", "a-2"].map(|stem| folder.name(stem, "csv"));
    let expected = ["β=10-.csv", "-..-etc-passwd.csv", "unnamed.csv", "unnamed-2.csv", "A.csv", "a-2.csv", "a-2-2.csv"];
    assert_eq!(names, expected);
    assert!(folder.name(&"ä".repeat(500), "csv").len() < 200);
}

#[test]
fn lines_of_the_list_name_files_of_the_folder() {
    let line = Line::read("run 0000001f report.html").unwrap();
    assert_eq!((line.command, line.sum, line.name), ("run", 31, "report.html"));
    assert_eq!(line.render(), "run 0000001f report.html\n");
    for text in ["", "run", "run x report.html", "run 1 ../model.toml", "run 1 ..", "run 1 .kardan-files"] {
        assert!(Line::read(text).is_none(), "{text}");
    }
    // The sum detects one changed bit, another order of words, and an additional zero.
    let blocks = b"eight by8 bytes.and a rest";
    for other in
        [&b"eight by8 bytes.and a resu"[..], b"8 bytes.eight byand a rest", b"eight by8 bytes.and a rest\0", b""]
    {
        assert_ne!(sum(blocks), sum(other));
    }
}
