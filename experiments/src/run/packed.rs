//! Files compressed by zstd, which have names that end in `.zst`.

use std::path::Path;

use anyhow::{Context, Result};

/// The content of the file `path` for `bytes`: compressed if the name ends in `.zst`.
///
/// # Errors
/// If the compression fails.
pub fn packed(path: &Path, bytes: Vec<u8>) -> Result<Vec<u8>> {
    // Small rather than fast: a table is written once.
    const LEVEL: i32 = 19;
    if !is_packed(path) {
        return Ok(bytes);
    }
    zstd::encode_all(bytes.as_slice(), LEVEL).with_context(|| path.display().to_string())
}

/// The text in a file.
///
/// # Errors
/// If the file is missing, is not text, or is not compressed although its name ends in `.zst`.
pub fn text(path: &Path) -> Result<String> {
    if !is_packed(path) {
        return Ok(fs_err::read_to_string(path)?);
    }
    let bytes = zstd::decode_all(fs_err::File::open(path)?).with_context(|| path.display().to_string())?;
    String::from_utf8(bytes).with_context(|| path.display().to_string())
}

fn is_packed(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "zst")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_compressed_where_its_name_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let [plain, small] = ["table.csv", "table.csv.zst"].map(|name| folder.path().join(name));
        let table = "task,return\n".repeat(100);
        for path in [&plain, &small] {
            fs_err::write(path, packed(path, table.clone().into_bytes()).unwrap()).unwrap();
            assert_eq!(text(path).unwrap(), table);
        }
        assert!(fs_err::read(&small).unwrap().len() < table.len() / 10);
        fs_err::write(&small, "no archive").unwrap();
        assert!(format!("{:#}", text(&small).unwrap_err()).contains("table.csv.zst"));
    }
}
