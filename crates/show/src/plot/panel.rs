//! One pair of axes with its curves.

use std::sync::Arc;

use kuva::TickFormat;
use kuva::plot::{BandPlot, LinePlot, ScatterPlot};
use kuva::render::annotations::ReferenceLine;
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::theme::Theme;

use super::pens::{of_mark, pale, pen_of};
use super::{LABEL_SIZE, LINE_WIDTH, Panel};
use crate::axis::Range;

const TITLE_SIZE: u32 = 17;
const TICK_SIZE: u32 = 13;
const MEMBER_WIDTH: f64 = 0.6;
const BAND_OPACITY: f64 = 0.18;

pub(super) fn draw(panel: &Panel, pens: &[(&str, String)], marks: &[&str]) -> (Vec<Plot>, Layout) {
    let mut plots = Vec::new();
    let (mut x_range, mut y_range) = (Range::EMPTY, Range::EMPTY);
    let (x_logarithmic, y_logarithmic) = (panel.logarithmic, panel.logarithmic && panel.rows.is_empty());
    let x_scale = |x: f64| if x_logarithmic { x.log10() } else { x };
    let y_scale = |y: f64| if y_logarithmic { y.log10() } else { y };
    let inside = |x: f64, y: f64| [x, y, x_scale(x), y_scale(y)].into_iter().all(drawable);
    let mut dots = false;
    // Bands lie below all lines.
    for series in panel.series.iter().filter(|series| !series.band.is_empty()) {
        let (x, (low, high)): (Vec<_>, (Vec<_>, Vec<_>)) = series.band.iter().map(|&(x, l, h)| (x, (l, h))).unzip();
        low.iter().chain(&high).for_each(|&y| y_range.include(y_scale(y)));
        let color = pen_of(pens, &series.label);
        plots.push(Plot::from(BandPlot::new(x, low, high).with_color(color).with_opacity(BAND_OPACITY)));
    }
    // Members lie below what sums them up, whichever it is; where nothing does, they are what is shown.
    let members = panel.series.iter().flat_map(|series| {
        let color = pen_of(pens, &series.label);
        let color = if series.points.is_empty() { color.into() } else { pale(color) };
        series.members.iter().map(move |points| (points, MEMBER_WIDTH, color.clone()))
    });
    let sums = panel.series.iter().map(|series| (&series.points, LINE_WIDTH, pen_of(pens, &series.label).to_string()));
    for (points, width, color) in members.chain(sums) {
        let points: Vec<_> = points.iter().copied().filter(|&(x, y)| inside(x, y)).collect();
        for &(x, y) in &points {
            x_range.include(x_scale(x));
            y_range.include(y_scale(y));
        }
        dots |= points.len() == 1;
        plots.push(if points.len() == 1 {
            // A line of one point has no length.
            Plot::from(ScatterPlot::new().with_data(points).with_color(color).with_size(4.0))
        } else {
            Plot::from(LinePlot::new().with_data(points).with_color(color).with_stroke_width(width))
        });
    }
    let empty = x_range == Range::EMPTY;
    if !panel.rows.is_empty() {
        y_range.include(0.5);
        y_range.include(panel.rows.len() as f64 + 0.5);
    }
    if panel.from_zero {
        x_range.include(0.0);
        y_range.include(0.0);
    }
    // Lines may end at the edge; half a dot would be missing there.
    let (x_axis, y_axis) = (x_range.axis(if dots { 0.03 } else { 0.0 }), y_range.axis(0.04));
    let x_axis = if x_logarithmic { x_axis.powers_of_ten() } else { x_axis };
    let y_axis = if y_logarithmic { y_axis.powers_of_ten() } else { y_axis };
    // A cell without plots would vanish, axes and all.
    plots.push(Plot::from(LinePlot::new()));
    let mut layout = Layout::new((x_axis.low, x_axis.high), (y_axis.low, y_axis.high))
        // kuva would otherwise round the limits outward, by up to a quarter of the panel.
        .with_x_axis_min(x_axis.low)
        .with_x_axis_max(x_axis.high)
        .with_y_axis_min(y_axis.low)
        .with_y_axis_max(y_axis.high)
        .with_x_tick_format(TickFormat::Custom(Arc::new(move |value| x_axis.tick_label(value))))
        .with_y_tick_format(TickFormat::Custom(Arc::new(move |value| y_axis.tick_label(value))))
        .with_ticks(6)
        .with_title(if empty { format!("{} (no data)", panel.title) } else { panel.title.clone() })
        .with_x_label(&panel.x_label)
        .with_x_label_offset(0.0, -5.0)
        .with_y_label(&panel.y_label)
        .with_title_size(TITLE_SIZE)
        .with_label_size(LABEL_SIZE)
        .with_tick_size(TICK_SIZE)
        .with_theme(Theme { grid_color: "#e4e4e4".into(), ..Theme::light() });
    for (label, x) in &panel.marks {
        let color = of_mark(marks.iter().position(|mark| mark == label).unwrap_or(0));
        let line = ReferenceLine::vertical(*x).with_color(color).with_stroke_width(LINE_WIDTH);
        // Dashed but for this.
        layout = layout.with_reference_line(line.with_dasharray(""));
    }
    if x_logarithmic {
        layout = layout.with_log_x();
    }
    if y_logarithmic {
        layout = layout.with_log_y();
    }
    if !panel.rows.is_empty() {
        layout = layout.with_y_categories(panel.rows.clone());
    }
    (plots, layout)
}

/// Finite, and far enough from overflow for the sums and differences of axis scaling.
fn drawable(value: f64) -> bool {
    value.abs() < 1e100
}
