//! Tests of `src/files.rs`.

use super::*;

#[test]
fn a_byte_order_mark_is_removed() {
    assert_eq!(decode("x", b"\xef\xbb\xbfa = 1").unwrap(), "a = 1");
    assert_eq!(decode("x", b"\xef\xbb\xbf \n").unwrap_err().code, "file::empty");
}

#[test]
fn an_endless_source_is_refused() {
    assert_eq!(bounded("zeros", std::io::repeat(0), MODEL_LIMIT).unwrap_err().code, "file::too-large");
    assert_eq!(
        bounded("just fits", std::io::repeat(b' ').take(MODEL_LIMIT), MODEL_LIMIT).unwrap().len() as u64,
        MODEL_LIMIT
    );
}
