//! Tests of `src/write/rows.rs`.

use super::*;

fn log_bytes() -> Vec<u8> {
    let values: Vec<f64> = (0..40).map(|k| f64::from(k) * 0.1).collect();
    let texts: Vec<String> = (0..40).map(|k| format!("row {}", k % 3)).collect();
    let column = Column { name: "x", unit: "m", description: "", values: &values };
    rows(&[column], &[("reason", &texts)], &[("sweep", "it")]).unwrap()
}

/// The published values of FNV-1a with 64 bits.
#[test]
fn the_checksum_is_fnv_1a() {
    for (text, sum) in [("", 0xcbf2_9ce4_8422_2325), ("a", 0xaf63_dc4c_8601_ec8c), ("foobar", 0x8594_4171_f739_67e8)] {
        let bytes = [text.as_bytes(), &[b'x'; DIGITS]].concat();
        let zeros = [b'0'; DIGITS]
            .iter()
            .fold(sum, |sum: u64, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3));
        assert_eq!(checksum(&bytes, &(text.len()..bytes.len())), zeros);
    }
}

/// The checksum detects a change of any bit, and of the length.
#[test]
fn every_changed_bit_and_every_other_length_is_refused() {
    let whole = log_bytes();
    assert_eq!(read_rows(whole.clone()).unwrap().texts[0].1.len(), 40);
    for bit in 0..8 * whole.len() {
        let mut damaged = whole.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(read_rows(damaged).is_err(), "bit {bit}");
    }
    for length in 0..whole.len() {
        assert!(read_rows(whole[..length].to_vec()).is_err(), "{length} bytes");
    }
    assert!(read_rows([&whole[..], &[0]].concat()).is_err());
}
