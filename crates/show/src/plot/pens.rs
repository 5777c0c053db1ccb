//! Colours of labels and marks.

use crate::palette;

/// The lines of the first and the second label of marks, and so on.
const MARKS: [&str; 2] = ["#c0c0c0", "#808080"];

/// Of the n-th mark.
pub(super) fn of_mark(index: usize) -> &'static str {
    MARKS[index % MARKS.len()]
}

/// Of every label of a figure.
pub(super) fn pens<'a>(labels: &[&'a str]) -> Vec<(&'a str, String)> {
    labels.iter().copied().zip(palette::colors(labels)).collect()
}

pub(super) fn pen_of<'a>(pens: &'a [(&str, String)], label: &str) -> &'a str {
    &pens.iter().find(|(known, _)| *known == label).expect("every label has a pen").1
}
