//! A heat map: a share per row and column, as a colour and a number.

use kuva::render::render::{Primitive, Scene, TextAnchor};

/// What is drawn, from the top.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeatMap {
    /// Above everything.
    pub title: String,
    /// What the columns are called.
    pub columns: Vec<String>,
    /// One line each.
    pub rows: Vec<HeatRow>,
}

/// A line of the map.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeatRow {
    /// Heading, written once for consecutive lines that share it.
    pub heading: String,
    /// What the row is called.
    pub label: String,
    /// A share per column: 0 and less is white, 1 and more dark red. `None` leaves the cell empty.
    pub shares: Vec<Option<f64>>,
}

const MARGIN: f64 = 14.0;
/// Width of the names of the rows, and height of those of the columns.
const NAMES: f64 = 170.0;
const CELL: (f64, f64) = (38.0, 20.0);
const SIZE: u32 = 13;
const INK: &str = "#1a1a1a";

pub(super) fn draw(map: &HeatMap) -> Scene {
    let headings = map.rows.chunk_by(|one, next| one.heading == next.heading);
    let top = 2.0 * MARGIN + NAMES;
    let height = top + (map.rows.len() + headings.clone().count()) as f64 * CELL.1 + MARGIN;
    let left = MARGIN + NAMES;
    let mut scene = Scene::new(left + map.columns.len() as f64 * CELL.0 + MARGIN + NAMES / 2.0, height);
    scene.add(text(MARGIN, MARGIN + f64::from(SIZE), &map.title, TextAnchor::Start, true));
    for (column, name) in map.columns.iter().enumerate() {
        let x = left + (column as f64 + 0.6) * CELL.0;
        scene.add(turned(text(x, top - 4.0, name, TextAnchor::Start, false)));
    }
    let mut y = top;
    for of_heading in headings {
        y += CELL.1;
        scene.add(text(MARGIN, y - 5.0, &of_heading[0].heading, TextAnchor::Start, true));
        for row in of_heading {
            scene.add(text(left - 6.0, y + CELL.1 - 6.0, &row.label, TextAnchor::End, false));
            for (column, share) in row.shares.iter().enumerate() {
                let Some(share) = share else { continue };
                let x = left + column as f64 * CELL.0;
                scene.add(cell(x, y, *share));
                let mut number = text(x + CELL.0 / 2.0, y + CELL.1 - 6.0, &number(*share), TextAnchor::Middle, false);
                if *share > 0.6 {
                    recolored(&mut number, "#ffffff");
                }
                scene.add(number);
            }
            y += CELL.1;
        }
    }
    scene
}

/// In per cent, without a sign before zero.
fn number(share: f64) -> String {
    let text = format!("{:.0}", 100.0 * share);
    if text == "-0" { "0".into() } else { text }
}

/// From white to dark red.
fn cell(x: f64, y: f64, share: f64) -> Primitive {
    let level = share.clamp(0.0, 1.0);
    let [red, green, blue] = [[255.0, 140.0], [255.0, 20.0], [255.0, 30.0]]
        .map(|[white, dark]: [f64; 2]| (white + level * (dark - white)).round() as u8);
    Primitive::Rect {
        x,
        y,
        width: CELL.0 - 1.0,
        height: CELL.1 - 1.0,
        fill: format!("#{red:02x}{green:02x}{blue:02x}").into(),
        stroke: None,
        stroke_width: None,
        opacity: None,
    }
}

fn text(x: f64, y: f64, content: &str, anchor: TextAnchor, bold: bool) -> Primitive {
    Primitive::Text { x, y, content: content.into(), size: SIZE, anchor, rotate: None, bold, color: Some(INK.into()) }
}

fn turned(mut text: Primitive) -> Primitive {
    if let Primitive::Text { rotate, .. } = &mut text {
        *rotate = Some(-60.0);
    }
    text
}

fn recolored(text: &mut Primitive, other: &str) {
    if let Primitive::Text { color, .. } = text {
        *color = Some(other.into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::svg;

    #[test]
    fn a_share_is_a_colour_and_a_number() {
        let row = |label: &str, shares: &[Option<f64>]| HeatRow {
            heading: "Lift".into(),
            label: label.into(),
            shares: shares.into(),
        };
        let map = HeatMap {
            title: "loss".into(),
            columns: vec!["late".into(), "pushed".into()],
            rows: vec![row("soft", &[Some(-0.001), None]), row("stiff", &[Some(1.2), Some(0.5)])],
        };
        let drawn = svg(&draw(&map));
        assert!(["loss", "late", "soft", ">0<", ">120<", ">50<"].iter().all(|part| drawn.contains(part)), "{drawn}");
        assert_eq!(drawn.matches("Lift").count(), 1);
        assert!(drawn.contains("#ffffff") && drawn.contains("#8c141e") && drawn.contains("#c68a8f"), "{drawn}");
    }
}
