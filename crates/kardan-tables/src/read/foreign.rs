//! Known formats without a reader.

use super::LogError;

/// The format of the first bytes, if it is such a format.
pub(super) fn foreign(head: &[u8]) -> Option<LogError> {
    let text = String::from_utf8_lossy(head).trim_start_matches(['\u{feff}', ' ', '\n', '\r', '\t']).to_lowercase();
    let (what, help) = if head.starts_with(b"\x89HDF\r\n\x1a\n") || head.starts_with(b"MATLAB 7.3 MAT-file") {
        ("the file is HDF5 (MAT v7.3)", "save it as `save -v7 FILE ...` in MATLAB or as Parquet, MDF or CSV")
    } else if head.starts_with(b"PARE") {
        ("the Parquet file is encrypted", "write it without encryption")
    } else if head.starts_with(b"PK\x03\x04") {
        ("the file is a ZIP archive (or Excel)", "unpack it, or save the sheet as CSV")
    } else if head.starts_with(b"\xd0\xcf\x11\xe0") {
        ("the file is an old Excel file", "save the sheet as CSV")
    } else if head.starts_with(b"\x1f\x8b") {
        ("the file is compressed with gzip", "unpack it first (`gunzip FILE`)")
    } else if head.starts_with(b"\x28\xb5\x2f\xfd") {
        ("the file is compressed with Zstandard", "unpack it first (`unzstd FILE`)")
    } else if head.starts_with(b"BZh") {
        ("the file is compressed with bzip2", "unpack it first (`bunzip2 FILE`)")
    } else if head.starts_with(b"\xfd7zXZ\0") {
        ("the file is compressed with xz", "unpack it first (`unxz FILE`)")
    } else if head.starts_with(b"7z\xbc\xaf\x27\x1c") {
        ("the file is a 7-Zip archive", "unpack it first")
    } else if head.starts_with(b"ARROW1") || head.starts_with(b"FEA1") {
        ("the file is an Arrow (Feather) file", "write it as Parquet")
    } else if head.starts_with(b"TDSm") {
        ("the file is a TDMS file", "export it as CSV or MDF 4")
    } else if head.starts_with(b"%PDF") {
        ("the file is a PDF document", "give the log itself")
    } else if text.starts_with("<!doctype html") || text.starts_with("<html") {
        ("the file is a web page", "download the log itself; a login or error page was saved in its place")
    } else if text.starts_with("<?xml") {
        ("the file is XML", "export the log as CSV, Parquet, MAT or MDF 4")
    } else if text.starts_with("{\\rtf") || text.starts_with("%!ps") {
        ("the file is a document", "give the log itself")
    } else if text.starts_with("{\"") || text.starts_with("{\n") || text.starts_with("[{") {
        ("the file is JSON", "export the log as CSV, Parquet, MAT or MDF 4")
    } else if text.starts_with("version https://git-lfs") {
        ("the file is a pointer of Git LFS", "fetch the log itself (`git lfs pull`)")
    } else {
        return None;
    };
    Some(LogError::unsupported(what, help))
}
