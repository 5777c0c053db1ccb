//! Colours of labels, members and marks.

use crate::palette;

/// The lines of the first and the second label of marks, and so on.
const MARKS: [&str; 2] = ["#c0c0c0", "#808080"];

/// How much of a member's colour is white: what sums the members up stands out.
const MEMBER_PALENESS: f64 = 0.6;

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

/// A colour `#rrggbb`, nearer to white.
pub(super) fn pale(color: &str) -> String {
    palette::mixed(color, 255, MEMBER_PALENESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_paler_than_what_sums_them_up() {
        assert_eq!(pale(pen_of(&pens(&["mine", "aforce"]), "aforce")), "#99c7e0");
    }
}
