//! Colours and line styles.

use kuva::plot::LineStyle;

use crate::palette::{self, OTHERS};

/// The lines of the first and the second label of marks, and so on.
const MARKS: [(&str, LineStyle); 2] = [("#c0c0c0", LineStyle::Solid), ("#808080", LineStyle::Solid)];

/// How much of a member's colour is white: what sums the members up stands out.
const MEMBER_PALENESS: f64 = 0.6;

/// Colour and line style.
pub(super) type Pen = (&'static str, LineStyle);

/// Of the n-th mark.
pub(super) fn mark_pen(index: usize) -> Pen {
    MARKS[index % MARKS.len()].clone()
}

/// Of every label: an action space's own colour; for the others those that no space of this figure has, and other line styles
/// once they are used up.
pub(super) fn pens<'a>(labels: &[&'a str]) -> Vec<(&'a str, Pen)> {
    let styles = [LineStyle::Solid, LineStyle::Dashed, LineStyle::Dotted, LineStyle::DashDot];
    let taken: Vec<&str> = labels.iter().filter_map(|label| palette::of_space(label)).collect();
    let free: Vec<&str> = OTHERS.into_iter().filter(|color| !taken.contains(color)).collect();
    let mut others = styles.iter().flat_map(|style| free.iter().map(|color| (*color, style.clone()))).cycle();
    let pen = |label: &&'a str| {
        let own = palette::of_space(label).map(|color| (color, LineStyle::Solid));
        (*label, own.unwrap_or_else(|| others.next().expect("a cycle of some colours")))
    };
    labels.iter().map(pen).collect()
}

pub(super) fn pen_of(pens: &[(&str, Pen)], label: &str) -> Pen {
    pens.iter().find(|(known, _)| *known == label).expect("every label has a pen").1.clone()
}

/// A colour `#rrggbb`, nearer to white.
pub(super) fn pale(color: &str) -> String {
    let mixed = |at: usize| {
        let value = u8::from_str_radix(&color[at..at + 2], 16).expect("a colour of the palette");
        (f64::from(value) + MEMBER_PALENESS * (255.0 - f64::from(value))).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", mixed(1), mixed(3), mixed(5))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_space_keeps_its_colour_whatever_else_is_drawn() {
        let pens = pens(&["mine", "variable", "AFORCE", "yours"]);
        let colors: Vec<&str> = pens.iter().map(|(_, (color, _))| *color).collect();
        assert_eq!(colors, ["#009e73", "#d55e00", "#0072b2", "#cc79a7"]);
        assert_eq!(pale("#0072b2"), "#99c7e0");
    }
}
