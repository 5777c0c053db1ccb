//! One pair of axes with its curves.

use std::sync::Arc;

use kuva::TickFormat;
use kuva::plot::scatter::MarkerShape;
use kuva::plot::{BandPlot, LinePlot, ScatterPlot};
use kuva::render::annotations::ReferenceLine;
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::theme::Theme;

use super::pens::{of_mark, pen_of};
use super::{LABEL_SIZE, LINE_WIDTH, Panel, Reach, reach};
use crate::axis::Range;

const TITLE_SIZE: u32 = 17;
const TICK_SIZE: u32 = 13;
/// Radius of a dot, and of the triangle where something is cut off.
const DOT_SIZE: f64 = 4.0;
const BAND_OPACITY: f64 = 0.18;

pub(super) fn draw(panel: &Panel, pens: &[(&str, String)], marks: &[&str]) -> (Vec<Plot>, Layout) {
    let mut plots = Vec::new();
    let (mut x_range, mut y_range) = (Range::EMPTY, Range::EMPTY);
    let (x_logarithmic, y_logarithmic) = (panel.logarithmic, panel.logarithmic && panel.rows.is_empty());
    let x_scale = |x: f64| if x_logarithmic { x.log10() } else { x };
    let y_scale = |y: f64| if y_logarithmic { y.log10() } else { y };
    let inside = |x: f64, y: f64| [x, y, x_scale(x), y_scale(y)].into_iter().all(reach::drawable);
    let limits = reach::limits(panel);
    let within = |y: f64| limits.map_or(y, |[low, high]| y.clamp(low, high));
    let mut has_dots = false;
    // Bands lie below all lines.
    for series in panel.series.iter().filter(|series| !series.band.is_empty()) {
        let of_band = series.band.iter().map(|&(x, low, high)| (x, (within(low), within(high))));
        let (x, (low, high)): (Vec<_>, (Vec<_>, Vec<_>)) = of_band.unzip();
        low.iter().chain(&high).for_each(|&y| y_range.include(y_scale(y)));
        let color = pen_of(pens, &series.label);
        plots.push(Plot::from(BandPlot::new(x, low, high).with_color(color).with_opacity(BAND_OPACITY)));
    }
    for series in &panel.series {
        let color = pen_of(pens, &series.label);
        let visible = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
            points.iter().filter(|(x, y)| inside(*x, *y)).map(|&(x, y)| (x, within(y))).collect()
        };
        let (curve, dots) = (visible(&series.points), visible(&series.dots));
        for &(x, y) in curve.iter().chain(&dots) {
            x_range.include(x_scale(x));
            y_range.include(y_scale(y));
        }
        if curve.len() > 1 {
            plots.push(Plot::from(LinePlot::new().with_data(curve).with_color(color).with_stroke_width(LINE_WIDTH)));
        } else {
            // A line of one point has no length.
            has_dots |= !curve.is_empty();
            plots.push(Plot::from(scatter(curve, color)));
        }
        has_dots |= !dots.is_empty();
        plots.push(Plot::from(scatter(dots, color)));
        if let Some(limits) = limits {
            for (x, edge) in reach::beyond(series, limits) {
                let outward = if edge == limits[1] { MarkerShape::Triangle } else { MarkerShape::TriangleDown };
                plots.push(Plot::from(scatter(vec![(x, edge)], color).with_marker(outward)));
            }
        }
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
    if let Reach::Between(low, high) = panel.y_reach {
        y_range.include(low);
        y_range.include(high);
    }
    // Lines may end at the edge; half a dot would be missing there.
    let (x_axis, y_axis) = (x_range.axis(if has_dots { 0.03 } else { 0.0 }), y_range.axis(0.04));
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

fn scatter(points: Vec<(f64, f64)>, color: &str) -> ScatterPlot {
    ScatterPlot::new().with_data(points).with_color(color).with_size(DOT_SIZE)
}
