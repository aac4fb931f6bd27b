//! Tests of `src/render.rs`.

use super::*;

fn rendered(text: &str, diagnostic: Diagnostic) -> String {
    let mut out = String::new();
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor());
    render(&mut out, &handler, &diagnostic, Some(&Arc::new(Shown::new("gear.toml", text))));
    out
}

#[test]
fn a_place_is_shown_with_its_line_and_help() {
    let diagnostic = Diagnostic::error("unit::unknown", "unknown unit").at(10..12, "here").help("use kg");
    let out = rendered("a = 1\nb = kq\nc = 2\n", diagnostic);
    for part in ["unit::unknown", "unknown unit", "gear.toml:2:5", "b = kq", "here", "help: use kg"] {
        assert!(out.contains(part), "{part} missing in\n{out}");
    }
}

#[test]
fn what_the_command_has_added_is_reported_by_its_path() {
    let added = kardan::entries::Place::Path("control.design.inputs[0]".into());
    let out = rendered("[shaft.a]\n", Diagnostic::error("a::b", "wrong").at(added, "here"));
    assert!(out.contains("wrong (at `control.design.inputs[0]`)") && !out.contains("[shaft.a]"), "{out}");
}

#[test]
fn spans_outside_the_text_or_inside_a_letter_do_no_harm() {
    for span in [0..0, 1..2, 3..900, 900..901, std::ops::Range { start: 5, end: 2 }] {
        for text in ["", "β", "a = 'β'", "\n\n", "β\nβ\r\n"] {
            let out = rendered(text, Diagnostic::error("a::b", "wrong").at(span.clone(), "here"));
            assert!(out.contains("wrong") && !out.contains("Failed to read"), "{span:?} of {text:?}:\n{out}");
        }
    }
}

/// The window around a place shows what miette shows of the whole text.
#[test]
fn a_window_shows_the_same_lines_as_the_whole_text() {
    for text in ["", "a", "a\n", "\n\nβ = 1\r\nb\n\n\nc = 2\nd\ne\nf", &"[t]\nx = 1\n\n".repeat(9)] {
        let shown = Shown::new("gear.toml", text);
        for (start, length) in (0..=text.len()).flat_map(|start| [(start, 0), (start, 1), (start, 7), (start, 30)]) {
            let end = text.floor_char_boundary(start + length);
            let span = SourceSpan::from((start, end.saturating_sub(start)));
            for (before, after) in [(0, 0), (1, 1), (2, 0)] {
                let window = shown.read_span(&span, before, after).expect("inside");
                let whole = text.read_span(&span, before, after).expect("inside");
                let parts =
                    |found: &dyn SpanContents<'_>| (found.data().to_vec(), *found.span(), found.line(), found.column());
                assert_eq!(parts(&*window), parts(&*whole), "{span:?} of {text:?}");
            }
        }
    }
}

/// Two spans of one error are shown each with its lines, not with the text between.
#[test]
fn places_far_apart_are_shown_apart() {
    let text: String = (0..1000).map(|k| format!("key_{k} = 1\n")).collect();
    let place = |key: &str| text.find(key).map(|at| at..at + key.len()).expect(key);
    let diagnostic = Diagnostic::error("a::b", "twice").at(place("key_100 "), "first").at(place("key_900 "), "again");
    let out = rendered(&text, diagnostic);
    for part in ["key_100 ", "first", "key_900 ", "again"] {
        assert!(out.contains(part), "{part} missing in\n{out}");
    }
    assert!(!out.contains("key_500 ") && out.lines().count() < 30, "{out}");
}

#[test]
fn long_lines_give_a_place_and_no_text() {
    let text = format!("a = 1\nb = \"{}\"\n", "x".repeat(100_000));
    let out = rendered(&text, Diagnostic::error("a::b", "wrong").at(10..20, "here"));
    assert!(out.contains("gear.toml:2:5: wrong") && out.len() < 500, "{out}");
}

#[test]
fn long_spans_show_their_first_line() {
    let text = "a = 1\n".repeat(1000);
    assert!(rendered(&text, Diagnostic::error("a::b", "wrong").at(6..6000, "here")).len() < 1000);
}

#[test]
fn terminal_escapes_are_defused_and_offsets_unchanged() {
    assert_eq!(visible("a\u{1b}[31m\u{85}\tb"), "a?[31m??\tb");
    assert_eq!((visible("a\u{202e}b"), aligned("a\u{202e}b")), ("a\\u{202e}b".into(), "a???b".into()));
    assert!(!rendered("a\u{1b}[31m", Diagnostic::error("a::b", "\u{1b}").at(0..3, "\u{7}")).contains('\u{1b}'));
}
