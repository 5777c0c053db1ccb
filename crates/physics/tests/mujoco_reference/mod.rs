//! Reads what `scripts/mujoco_reference.py` wrote.

use std::fs;
use std::path::Path;

/// Rows of a reference file: leading `names` columns of text, the rest numbers.
pub fn reference(file: &str, names: usize) -> Vec<(Vec<String>, Vec<f64>)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("reference").join(file);
    let text = fs::read_to_string(path).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    rows.map(|row| {
        let cells: Vec<&str> = row.split(',').collect();
        let (names, numbers) = cells.split_at(names);
        (names.iter().map(|s| s.to_string()).collect(), numbers.iter().map(|s| s.parse().unwrap()).collect())
    })
    .collect()
}
