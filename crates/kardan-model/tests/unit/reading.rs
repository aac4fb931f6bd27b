//! Tests of `src/reading.rs`.

use super::*;

#[test]
fn every_kind_of_signal_can_be_chosen() {
    let keywords: Vec<&str> = signal::REGISTRY.iter().map(|kind| kind.keyword).collect();
    assert!(!keywords.is_empty());
    assert_eq!(keywords, SIGNALS);
    for kind in signal::REGISTRY {
        let (document, diagnostics) = read(kind.example);
        let diagnostics: Vec<_> = diagnostics.into_iter().filter(|d| d.code != "model::no-shaft").collect();
        assert_eq!(diagnostics, [], "{}", kind.keyword);
        assert_eq!(document.signals.len(), 1, "{}", kind.keyword);
    }
}

#[test]
fn every_kind_of_block_can_be_chosen() {
    let keywords: Vec<&str> = block::REGISTRY.iter().map(|kind| kind.keyword).collect();
    assert!(!keywords.is_empty());
    assert_eq!(keywords, BLOCKS);
    for kind in block::REGISTRY {
        let (document, diagnostics) = read(kind.example);
        let diagnostics: Vec<_> = diagnostics.into_iter().filter(|d| d.code != "model::no-shaft").collect();
        assert_eq!(diagnostics, [], "{}", kind.keyword);
        assert!(document.blocks.iter().any(|block| block.kind.keyword == kind.keyword), "{}", kind.keyword);
    }
}

#[test]
fn every_law_can_be_chosen() {
    let keywords: Vec<&str> = kardan_synthesis::REGISTRY.iter().map(|law| law.keyword).collect();
    assert!(!keywords.is_empty());
    assert_eq!(keywords, LAWS);
}

#[test]
fn every_element_that_sticks_can_be_stuck() {
    let stick_keys = ["friction", "static_factor", "restitution", "engaged"];
    let has = |kind: &&element::Element| {
        kind.keyword == "one_way_clutch" || kind.fields.iter().any(|field| stick_keys.contains(&field.name))
    };
    let keywords: Vec<&str> = element::REGISTRY.iter().filter(has).map(|kind| kind.keyword).collect();
    assert_eq!(keywords, tables::HOLDING);
}

/// The examples of the manual are valid tables of their kind.
#[test]
fn examples_parse() {
    let examples = element::REGISTRY.iter().map(|kind| (kind.keyword, kind.example));
    let laws = kardan_synthesis::REGISTRY.iter().map(|law| (law.keyword, law.example));
    let mut count = 0;
    for (keyword, example) in examples.chain(laws) {
        let (document, diagnostics) = read(example);
        let diagnostics: Vec<_> = diagnostics.into_iter().filter(|d| d.code != "model::no-shaft").collect();
        assert_eq!(diagnostics, [], "{keyword}");
        // The example of a law may need a sensor.
        let law = kardan_synthesis::find(keyword).is_some();
        let elements = document.elements.iter().filter(|element| element.kind.keyword == keyword).count();
        assert_eq!(if law { document.controls.len() } else { elements }, 1, "{keyword}");
        count += 1;
    }
    assert!(count > 0);
}
