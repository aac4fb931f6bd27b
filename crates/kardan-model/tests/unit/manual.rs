//! Tests of `src/manual.rs`.

use super::super::read;
use super::*;

#[test]
fn every_page_shows_its_keys() {
    for (name, fields) in STUDY_TABLES {
        assert!(study_pages().any(|page| page == *name));
        let page = manual_of(name).unwrap_or_default();
        for field in *fields {
            assert!(page.contains(&format!("\n  {} (", field.name)) && page.contains(field.doc), "{name}: {page}");
        }
    }
    for name in study_pages() {
        assert!(manual_of(name).is_some(), "{name}");
    }
    let page = manual_of("analysis").unwrap_or_default();
    for key in [
        "shaft (shaft or mass; also `mass`, required)",
        "measures (angle | speed, left out: angle)",
        "cost (number, zero or more, left out: 1)",
    ] {
        assert!(page.contains(key), "{key}: {page}");
    }
    assert!(manual().contains("[analysis]") && manual_of("nothing").is_none());
}

/// A default is itself a valid value of its key.
#[test]
fn defaults_are_values_of_their_keys() {
    fn check(fields: &[Field], count: &mut usize) {
        for field in fields {
            if let Kind::Tables(inner) | Kind::Table(inner) = field.kind {
                check(inner, count);
            }
            let Some(default) = field.default else { continue };
            let entry = kardan_schema::entries::Entry::from(kardan_schema::entries::RawValue::Text(default.into()));
            let mut diagnostics = Vec::new();
            let read = super::super::parse::value(&field.kind, field.name, &entry, &mut diagnostics);
            assert_eq!(diagnostics, [], "{} = {default}", field.name);
            assert!(read.is_some() && !field.required);
            assert!(field.default_number().is_some() != field.default_word().is_some(), "{}", field.name);
            assert!(!field.doc.contains("eft out: ") || field.doc.contains(", of "), "{}: {}", field.name, field.doc);
            *count += 1;
        }
    }
    let mut count = 0;
    element::REGISTRY.iter().for_each(|kind| check(kind.fields, &mut count));
    kardan_synthesis::REGISTRY.iter().for_each(|law| check(law.fields, &mut count));
    signal::REGISTRY.iter().for_each(|kind| check(kind.fields, &mut count));
    for (_, fields) in STUDY_TABLES {
        check(fields, &mut count);
    }
    assert!(count > 40, "{count}");
}

#[test]
fn the_examples_of_the_pages_can_be_read() {
    let pages = STUDY_TABLES.iter().map(|(page, _)| example_of(page));
    for example in pages.chain([PARAMETERS.split("Example\n").nth(1).unwrap_or_default()]) {
        let (_, diagnostics) = read(example);
        assert!(!example.is_empty());
        assert!(diagnostics.iter().all(|d| d.code == "model::no-shaft"), "{example}: {diagnostics:?}");
    }
    let forms: Vec<&str> =
        PARAMETERS.lines().filter_map(|line| line.strip_prefix("      \"")?.split('"').next()).collect();
    assert_eq!(forms.len(), 5);
    for form in forms {
        let read = kardan_math::units::parse_tolerated(form);
        assert!(read.as_ref().is_ok_and(|read| read.text == "0.0081 N m s/rad"), "{form}: {read:?}");
    }
}
