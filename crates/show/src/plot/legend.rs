//! The legend below all panels.

use kuva::render::render::{Primitive, Scene, TextAnchor};

use super::{LABEL_SIZE, LINE_WIDTH, MARGIN, Panel, once};

/// Every label once, in order of appearance; none where no panel has two curves to tell apart.
pub(super) fn labels(panels: &[Panel]) -> Vec<&str> {
    if panels.iter().all(|panel| panel.series.len() < 2) {
        return vec![];
    }
    once(panels.iter().flat_map(|panel| &panel.series).map(|series| series.label.as_str()))
}

/// Every label of a mark once.
pub(super) fn mark_labels(panels: &[Panel]) -> Vec<&str> {
    once(panels.iter().flat_map(|panel| &panel.marks).map(|(label, _)| label.as_str()))
}

/// Adds a strip below the panels with the labels side by side, in as many rows as they need: a dash or a dot, and the label.
pub(super) fn add(scene: &mut Scene, labels: &[(&str, &str, bool)]) {
    const SWATCH: f64 = 30.0;
    const GAP: f64 = 8.0;
    const ROW: f64 = 24.0;
    /// Mean width of a DejaVu Sans character, on the generous side; the fallback fonts are narrower.
    const CHARACTER: f64 = 0.62 * LABEL_SIZE as f64;
    let Some(longest) = labels.iter().map(|(label, ..)| label.chars().count()).max() else { return };
    let widest = SWATCH + GAP + longest as f64 * CHARACTER + 3.0 * GAP;
    // Equal columns, and rows as even as they can be.
    let fitting = (((scene.width - 2.0 * MARGIN) / widest) as usize).clamp(1, labels.len());
    let rows = labels.len().div_ceil(fitting);
    let columns = labels.len().div_ceil(rows);
    let left = (scene.width - columns as f64 * widest + 3.0 * GAP) / 2.0;
    let top = scene.height;
    scene.height += rows as f64 * ROW + MARGIN;
    for (index, (label, color, dot)) in labels.iter().enumerate() {
        let x = left + (index % columns) as f64 * widest;
        let y = top + ((index / columns) as f64 + 0.5) * ROW;
        scene.add(if *dot {
            Primitive::Circle {
                cx: x + SWATCH / 2.0,
                cy: y,
                r: 4.0,
                fill: (*color).into(),
                fill_opacity: None,
                stroke: None,
                stroke_width: None,
            }
        } else {
            Primitive::Line {
                x1: x,
                y1: y,
                x2: x + SWATCH,
                y2: y,
                stroke: (*color).into(),
                stroke_width: 1.5 * LINE_WIDTH,
                stroke_dasharray: None,
            }
        });
        scene.add(Primitive::Text {
            x: x + SWATCH + GAP,
            // The baseline: digits and capitals are then centred on the swatch.
            y: y + 0.36 * LABEL_SIZE as f64,
            content: label.to_string(),
            size: LABEL_SIZE,
            anchor: TextAnchor::Start,
            rotate: None,
            bold: false,
            color: None,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::tests::panel;

    #[test]
    fn a_legend_only_where_curves_must_be_told_apart() {
        let line: &[_] = &[(0.0, 0.0), (1.0, 1.0)];
        assert!(labels(&[panel(&[line]), panel(&[line])]).is_empty());
        assert_eq!(labels(&[panel(&[line]), panel(&[line, line])]), ["s0", "s1"]);
    }
}
