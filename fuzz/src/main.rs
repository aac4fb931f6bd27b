//! The binary that libFuzzer drives; the variable `KARDAN_FUZZ` names the target.
#![no_main]
// The macro gives libFuzzer a function with a name of its own choice.
#![allow(unsafe_code)]

use std::sync::OnceLock;

static TARGET: OnceLock<fn(&[u8])> = OnceLock::new();

libfuzzer_sys::fuzz_target!(
    init: {
        // libFuzzer's own hook ends the process at every panic, also at one of a foreign decoder that the library catches and
        // tells. Panics that arrive here still do.
        drop(std::panic::take_hook());
        let name = std::env::var("KARDAN_FUZZ").unwrap_or_default();
        let Some((_, target)) = kardan_fuzz::TARGETS.iter().find(|(known, _)| *known == name) else {
            eprintln!("set KARDAN_FUZZ to one of {:?}", kardan_fuzz::TARGETS.map(|(name, _)| name));
            std::process::exit(2);
        };
        TARGET.get_or_init(|| *target);
    },
    |data: &[u8]| {
        if let Some(target) = TARGET.get() {
            target(data);
        }
    }
);
