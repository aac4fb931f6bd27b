//! A linear system given by its matrices: `A`, `B`, `C`, `D` and possibly `E` in JSON or in a MAT file.

mod json;
mod mat;
mod parsed;
mod system;

use json::read_json;
use mat::read_mat;
pub use system::{DataDigits, StateSpace};

use kardan_schema::diagnostics::Diagnostic;

/// The longest file: enough for the largest matrices.
const FILE_LIMIT: usize = 1 << 30;

/// Reads a linear system `E ẋ = A x + B u`, `y = C x + D u` given by its matrices.
///
/// The bytes are a MAT file of version 5 (`save -v7` or `-v6`, SciPy) with variables `A`, `B`, `C`, `D` and `E`, or with a
/// structure that has these fields; or else JSON, an object with these keys. `A` is needed; without `B` there are no
/// inputs, without `C` no outputs, without `D` no feedthrough, without `E` it is the identity; it may be singular. `states`, `inputs` and
/// `outputs` may name the variables, which are `x1`…, `u1`… and `y1`… otherwise.
///
/// Numbers of JSON are taken as written: `0.1` is one tenth; `"1/3"` is one third. Those of a MAT file are the exact
/// values of the binary numbers in it. A list of numbers instead of a matrix is a column in `B` and a row in `C`; a matrix
/// of another shape is an error, never transposed. A sample time (`Ts`, `dt`, `sample_time`) other than 0 makes it
/// `E x(k+1) = A x(k) + B u(k)`; −1 is one that is not known. Places of diagnostics refer to the text behind a byte order
/// mark.
///
/// ```
/// use kardan_model::read_state_space;
/// let json = br#"{"A": [[0, 1], ["-1/3", -0.1]], "B": [0, 1], "C": [1, 0]}"#;
/// let system = read_state_space(json).unwrap().system;
/// assert_eq!(system.inputs, ["u1"]);
/// assert_eq!(system.a[(1, 1)], kardan_math::num::Rational::from_parts((-1).into(), 10u8.into()));
/// ```
///
/// # Errors
/// All errors: unreadable parts, matrices of inconsistent sizes, entries that are not finite
/// numbers, more than 2000 states, inputs or outputs.
pub fn read_state_space(bytes: &[u8]) -> Result<StateSpace, Vec<Diagnostic>> {
    let one = |diagnostic| Err(vec![diagnostic]);
    if bytes.len() > FILE_LIMIT {
        let message =
            format!("the file is larger than {} MiB, too large for the matrices of a system", FILE_LIMIT >> 20);
        return one(Diagnostic::error("state-space::too-large", message).help("is it the file that you meant?"));
    }
    if bytes.starts_with(b"MATLAB 5.0 MAT-file") {
        return read_mat(bytes);
    }
    if bytes.starts_with(b"MATLAB 7.3 MAT-file") || bytes.starts_with(b"\x89HDF\r\n\x1a\n") {
        return one(other_version("7.3 (HDF5)"));
    }
    if bytes.starts_with(b"MATLAB ") {
        return one(other_version("unknown to this program"));
    }
    if is_version_4(bytes) {
        return one(other_version("4"));
    }
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return one(Diagnostic::error("file::utf-16", "the file is UTF-16 text, JSON is UTF-8")
            .help("save it as UTF-8, or convert it: iconv -f UTF-16 -t UTF-8 OLD > NEW"));
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            let at = error.valid_up_to();
            let line = bytes[..at].iter().filter(|byte| **byte == b'\n').count() + 1;
            let message = format!(
                "the file is neither a MAT file nor JSON: byte 0x{:02X} at offset {at} (line {line}) is not UTF-8 text",
                bytes[at]
            );
            return one(Diagnostic::error("file::not-utf-8", message).help(
                "give a MAT file written by `save -v7`, or JSON such as {\"A\": [[0, 1], [-2, -3]], \"B\": [0, 1]}",
            ));
        }
    };
    if text.trim().is_empty() {
        return one(Diagnostic::error("file::empty", "the file is empty")
            .help("write at least {\"A\": [[-1]]}; `B`, `C`, `D` and `E` may follow"));
    }
    read_json(text)
}

fn other_version(version: &str) -> Diagnostic {
    Diagnostic::error("mat::version", format!("the file is a MAT file of version {version}; version 5 is read"))
        .help("save it with `save -v7 FILE A B C D` (SciPy: savemat(FILE, ..., format=\"5\"))")
}

/// A version 4 file has no header: it begins with the type `MOPT`, the size and the length of the name of a matrix.
fn is_version_4(bytes: &[u8]) -> bool {
    let Some((head, _)) = bytes.split_first_chunk::<20>() else { return false };
    let plausible = |read: fn([u8; 4]) -> u32| {
        let number = |i: usize| read([head[4 * i], head[4 * i + 1], head[4 * i + 2], head[4 * i + 3]]);
        let (kind, name) = (number(0), number(4));
        let digits = (kind / 1000, kind / 100 % 10, kind / 10 % 10, kind % 10);
        digits.0 <= 4 && digits.1 == 0 && digits.2 <= 5 && digits.3 <= 2 && number(3) <= 1 && (1..=64).contains(&name)
    };
    plausible(u32::from_le_bytes) || plausible(u32::from_be_bytes)
}
