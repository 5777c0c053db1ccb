//! Colours of labels and marks.

use crate::palette;

/// Colours of marks with the first and the second label; after these they repeat.
const MARKS: [&str; 2] = ["#c0c0c0", "#808080"];

/// Colour of the marks with label number `index`.
pub(super) fn of_mark(index: usize) -> &'static str {
    MARKS[index % MARKS.len()]
}

/// The colour of every label of a figure.
pub(super) fn pens<'a>(labels: &[&'a str]) -> Vec<(&'a str, String)> {
    labels.iter().copied().zip(palette::colors(labels)).collect()
}

pub(super) fn pen_of<'a>(pens: &'a [(&str, String)], label: &str) -> &'a str {
    &pens.iter().find(|(known, _)| *known == label).expect("every label has a pen").1
}
