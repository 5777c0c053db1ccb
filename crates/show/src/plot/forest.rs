//! A forest plot: ratios with their intervals, one below the other, beside a line at one.
//!
//! The plot is as wide as a page on screen, so that its text is as large as the text around it. Its marks have no action space's colour,
//! because a ratio belongs to no space.

use kuva::render::render::{Primitive, Scene, TextAnchor};

use crate::axis::Range;

/// What is drawn, from the top.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Forest {
    /// Above everything.
    pub title: String,
    /// What a ratio below one means.
    pub less: String,
    /// What a ratio above one means.
    pub more: String,
    /// One line each.
    pub ratios: Vec<Ratio>,
}

/// A line of the plot.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ratio {
    /// Heading, written once for consecutive lines that share it.
    pub heading: String,
    /// What was compared.
    pub label: String,
    /// The ratio, above zero.
    pub value: f64,
    /// The ratio's interval. A ratio with an interval is drawn as a dot with a bar, one without as a cross.
    pub interval: Option<[f64; 2]>,
}

const WIDTH: f64 = 800.0;
/// Left and right edge of the axis; right of it stand the numbers.
const AXIS: (f64, f64) = (235.0, 620.0);
const MARGIN: f64 = 14.0;
const LINE: f64 = 23.0;
/// Space before a heading.
const GAP: f64 = 8.0;
const INK: &str = "#1a1a1a";
const FAINT: &str = "#6a6a6a";
const GRID: &str = "#e4e4e4";

/// How a text is set.
#[derive(Clone, Copy)]
struct Font {
    size: u32,
    bold: bool,
    color: &'static str,
}

const TITLE: Font = Font { size: 17, bold: true, color: INK };
const HEADING: Font = Font { size: 14, bold: true, color: INK };
const PLAIN: Font = Font { size: 14, bold: false, color: INK };
/// Font of ratios from other sources, which have no interval.
const QUIET: Font = Font { size: 14, bold: false, color: FAINT };

pub(super) fn draw(forest: &Forest) -> Scene {
    let mut reach = Range::EMPTY;
    for ratio in &forest.ratios {
        [[1.0; 2], ratio.interval.unwrap_or([ratio.value; 2])].concat().iter().for_each(|end| reach.include(end.ln()));
    }
    let reach = reach.axis(0.05);
    let at = |value: f64| AXIS.0 + (value.ln() - reach.low) / (reach.high - reach.low) * (AXIS.1 - AXIS.0);

    let headings = forest.ratios.chunk_by(|one, next| one.heading == next.heading);
    let top = 2.0 * MARGIN + f64::from(TITLE.size);
    let bottom = top + forest.ratios.len() as f64 * LINE + headings.clone().count() as f64 * (LINE + GAP);
    let hints = bottom + 1.7 * LINE;
    let mut scene = Scene::new(WIDTH, hints + MARGIN);
    scene.add(text(MARGIN, top - MARGIN, &forest.title, TextAnchor::Start, TITLE));
    scene.add(text(AXIS.1 + MARGIN, top - MARGIN, "95 % interval", TextAnchor::Start, QUIET));
    for (tick, x) in ticks().map(|tick| (tick, at(tick))).filter(|(_, x)| (AXIS.0..=AXIS.1).contains(x)) {
        scene.add(line((x, top), (x, bottom), if tick == 1.0 { INK } else { GRID }, 1.0));
        scene.add(text(x, bottom + 0.7 * LINE, &tick.to_string(), TextAnchor::Middle, PLAIN));
    }
    scene.add(text(at(1.0) - MARGIN, hints, &format!("← {}", forest.less), TextAnchor::End, PLAIN));
    scene.add(text(at(1.0) + MARGIN, hints, &format!("{} →", forest.more), TextAnchor::Start, PLAIN));

    let mut y = top;
    for of_heading in headings {
        y += GAP + LINE;
        scene.add(text(MARGIN, y, &of_heading[0].heading, TextAnchor::Start, HEADING));
        for ratio in of_heading {
            y += LINE;
            add(&mut scene, ratio, y, &at);
        }
    }
    scene
}

/// Adds a line with its text at the height `y`.
fn add(scene: &mut Scene, ratio: &Ratio, y: f64, at: &impl Fn(f64) -> f64) {
    let font = if ratio.interval.is_some() { PLAIN } else { QUIET };
    let (x, middle) = (at(ratio.value), y - 0.36 * f64::from(font.size));
    scene.add(text(2.0 * MARGIN, y, &ratio.label, TextAnchor::Start, font));
    scene.add(text(AXIS.1 + MARGIN, y, &numbers(ratio), TextAnchor::Start, font));
    if let Some([low, high]) = ratio.interval {
        scene.add(line((at(low), middle), (at(high), middle), font.color, 2.0));
        scene.add(Primitive::Circle {
            cx: x,
            cy: middle,
            r: 5.0,
            fill: font.color.into(),
            fill_opacity: None,
            stroke: None,
            stroke_width: None,
        });
    } else {
        for slope in [-4.0, 4.0] {
            scene.add(line((x - 4.0, middle - slope), (x + 4.0, middle + slope), font.color, 2.0));
        }
    }
}

/// 1, 2, 5, 10 and so on, below and above one.
fn ticks() -> impl Iterator<Item = f64> {
    (-6..6).flat_map(|power| [1, 2, 5].map(|digit| format!("{digit}e{power}").parse().expect("a number")))
}

/// The ratio and its interval, as text.
fn numbers(ratio: &Ratio) -> String {
    let interval = ratio.interval.map(|[low, high]| format!(" ({} to {})", two_digits(low), two_digits(high)));
    two_digits(ratio.value) + &interval.unwrap_or_default()
}

/// A ratio with two significant digits, above 99 with all digits before the point.
pub fn two_digits(ratio: f64) -> String {
    let digits = match ratio {
        ratio if ratio < 0.0995 => 3,
        ratio if ratio < 0.995 => 2,
        ratio if ratio < 9.95 => 1,
        _ => 0,
    };
    format!("{ratio:.digits$}")
}

fn line(from: (f64, f64), to: (f64, f64), color: &str, width: f64) -> Primitive {
    Primitive::Line {
        x1: from.0,
        y1: from.1,
        x2: to.0,
        y2: to.1,
        stroke: color.into(),
        stroke_width: width,
        stroke_dasharray: None,
    }
}

fn text(x: f64, y: f64, content: &str, anchor: TextAnchor, font: Font) -> Primitive {
    Primitive::Text {
        x,
        y,
        content: content.into(),
        size: font.size,
        anchor,
        rotate: None,
        bold: font.bold,
        color: Some(font.color.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_keeps_two_digits() {
        assert_eq!([131.0 / 7.0, 19.5 / 1.8, 4.04, 1.0 / 1.8].map(two_digits), ["19", "11", "4.0", "0.56"]);
        assert_eq!([9.96, 0.996, 0.0996, 0.0123].map(two_digits), ["10", "1.0", "0.10", "0.012"]);
    }

    #[test]
    fn every_number_stands_beside_its_mark_and_a_heading_once() {
        let ratio =
            |label: &str, value, interval| Ratio { heading: "Lift".into(), label: label.into(), value, interval };
        let ratios = vec![ratio("ours", 3.406, Some([2.75, 4.22])), ratio("theirs", 16.33, None)];
        let scene = draw(&Forest { ratios, ..Forest::default() });
        let texts: Vec<&str> = scene
            .elements
            .iter()
            .filter_map(|element| match element {
                Primitive::Text { content, .. } => Some(content.as_str()),
                _ => None,
            })
            .collect();
        let count = |wanted: &str| texts.iter().filter(|text| **text == wanted).count();
        let wanted = ["Lift", "ours", "3.4 (2.8 to 4.2)", "theirs", "16", "1", "10"];
        assert_eq!(wanted.map(count), [1; 7], "{texts:?}");
        assert!(
            !texts.contains(&"20") && !texts.contains(&"0.5"),
            "the axis ends with what is drawn and one: {texts:?}"
        );
        let dots = scene.elements.iter().filter(|element| matches!(element, Primitive::Circle { .. })).count();
        assert_eq!(dots, 1, "what has no interval is a cross");
    }
}
