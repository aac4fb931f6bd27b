//! Known formats without a reader.

use super::LogError;

/// First bytes, of a text in lower case and without blanks before it; what they show, and how to correct it.
const FORMATS: &[(&[&[u8]], &str, &str)] = &[
    (
        &[b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3 MAT-file"],
        "the file is HDF5 (MAT v7.3)",
        "save it as `save -v7 FILE ...` in MATLAB or as Parquet, MDF or CSV",
    ),
    (&[b"PARE"], "the Parquet file is encrypted", "write it without encryption"),
    (&[b"PK\x03\x04"], "the file is a ZIP archive (or Excel)", "unpack it, or save the sheet as CSV"),
    (&[b"\xd0\xcf\x11\xe0"], "the file is an old Excel file", "save the sheet as CSV"),
    (&[b"\x1f\x8b"], "the file is compressed with gzip", "unpack it first (`gunzip FILE`)"),
    (&[b"\x28\xb5\x2f\xfd"], "the file is compressed with Zstandard", "unpack it first (`unzstd FILE`)"),
    (&[b"BZh"], "the file is compressed with bzip2", "unpack it first (`bunzip2 FILE`)"),
    (&[b"\xfd7zXZ\0"], "the file is compressed with xz", "unpack it first (`unxz FILE`)"),
    (&[b"7z\xbc\xaf\x27\x1c"], "the file is a 7-Zip archive", "unpack it first"),
    (&[b"ARROW1", b"FEA1"], "the file is an Arrow (Feather) file", "write it as Parquet"),
    (&[b"TDSm"], "the file is a TDMS file", "export it as CSV or MDF 4"),
    (&[b"%PDF"], "the file is a PDF document", "give the log itself"),
    (
        &[b"<!doctype html", b"<html"],
        "the file is a web page",
        "download the log itself; a login or error page was saved in its place",
    ),
    (&[b"<?xml"], "the file is XML", "export the log as CSV, Parquet, MAT or MDF 4"),
    (&[b"{\\rtf", b"%!ps"], "the file is a document", "give the log itself"),
    (&[b"{\"", b"{\n", b"[{"], "the file is JSON", "export the log as CSV, Parquet, MAT or MDF 4"),
    (&[b"version https://git-lfs"], "the file is a pointer of Git LFS", "fetch the log itself (`git lfs pull`)"),
];

/// The format of the first bytes, if it is such a format.
pub(super) fn foreign(head: &[u8]) -> Option<LogError> {
    let text = String::from_utf8_lossy(head).trim_start_matches(['\u{feff}', ' ', '\n', '\r', '\t']).to_lowercase();
    let begins = |start: &&[u8]| head.starts_with(start) || text.as_bytes().starts_with(start);
    let (_, what, help) = FORMATS.iter().find(|(starts, ..)| starts.iter().any(begins))?;
    Some(LogError::unsupported(*what, *help))
}
