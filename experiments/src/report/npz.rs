//! Arrays of numbers that NumPy's `savez` wrote.

use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use zip::ZipArchive;

/// An array in row-major order.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Size along each index.
    pub shape: Vec<usize>,
    /// Flags are 0 and 1.
    pub values: Vec<f64>,
}

/// Every array of numbers or flags in `path`, with its name; arrays of anything else are left out.
///
/// # Errors
/// If `path` is not a file of `savez`.
pub fn read(path: &Path) -> Result<Vec<(String, Array)>> {
    let mut archive = ZipArchive::new(fs_err::File::open(path)?)?;
    let mut arrays = vec![];
    for at in 0..archive.len() {
        let mut entry = archive.by_index(at)?;
        let name = entry.name().trim_end_matches(".npy").to_string();
        let mut bytes = vec![];
        entry.read_to_end(&mut bytes).with_context(|| name.clone())?;
        if let Some(array) = array(&bytes).with_context(|| name.clone())? {
            arrays.push((name, array));
        }
    }
    Ok(arrays)
}

/// A `.npy` file: `\x93NUMPY`, the version, the length of the header, the header, the numbers.
fn array(bytes: &[u8]) -> Result<Option<Array>> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").context("not one of NumPy's arrays")?;
    let (length, start) = match rest {
        [1, _, low, high, ..] => (u16::from_le_bytes([*low, *high]) as usize, 4),
        [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, 6),
        _ => bail!("a version of NumPy's arrays that is not known"),
    };
    let header = rest.get(start..start + length).context("its header is cut off")?;
    let header = std::str::from_utf8(header)?;
    let after =
        |key: &str| header.split_once(key).map(|(_, rest)| rest.trim_start()).with_context(|| format!("no {key}"));
    let kind = after("'descr':")?.split('\'').nth(1).unwrap_or_default().to_string();
    ensure!(after("'fortran_order':")?.starts_with("False"), "its first index is the fastest: save it in C's order");
    let sizes = after("'shape':")?.trim_start_matches('(').split(')').next().unwrap_or_default();
    let sizes = sizes.split(',').map(str::trim).filter(|size| !size.is_empty());
    let shape = sizes.map(|size| Ok(size.parse()?)).collect::<Result<Vec<usize>>>()?;
    let data = &rest[start + length..];
    let values: Vec<f64> = match kind.as_str() {
        "<f8" => data.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect(),
        "<f4" => data.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes).into()).collect(),
        "<i8" => data.as_chunks().0.iter().map(|bytes| i64::from_le_bytes(*bytes) as f64).collect(),
        "<i4" => data.as_chunks().0.iter().map(|bytes| i32::from_le_bytes(*bytes).into()).collect(),
        "|b1" => data.iter().map(|&flag| f64::from(flag)).collect(),
        _ => return Ok(None),
    };
    let count = shape.iter().try_fold(1usize, |product, &size| product.checked_mul(size));
    ensure!(Some(values.len()) == count, "{} numbers, but a shape of {shape:?}", values.len());
    Ok(Some(Array { shape, values }))
}
