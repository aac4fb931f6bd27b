//! Tests of `src/signal_name.rs`.

use super::*;

#[test]
fn parts_make_the_name_again() {
    for name in ["rk.phi", "gear.rack.tau", "ref", "a.b.c.tau", "", ".", "x.", ".phi", "rk.speed"] {
        assert_eq!(SignalName::new(name).to_string(), name);
    }
    for (quantity, word, _) in QUANTITIES {
        let name = quantity.of("rk");
        assert_eq!((SignalName::new(&name).is(quantity), quantity.word()), (true, word));
    }
}
