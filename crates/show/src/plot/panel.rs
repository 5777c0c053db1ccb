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
use super::{LABEL_SIZE, LINE_WIDTH, Panel, Reach, Series, reach};
use crate::axis::Range;

const TITLE_SIZE: u32 = 17;
const TICK_SIZE: u32 = 13;
/// Radius of a dot, and of the triangle where something is cut off.
const DOT_SIZE: f64 = 4.0;
const BAND_OPACITY: f64 = 0.18;

pub(super) fn draw(panel: &Panel, pens: &[(&str, String)], marks: &[&str]) -> (Vec<Plot>, Layout) {
    let mut curves = Curves::new(panel);
    // Bands lie below all lines.
    for series in panel.series.iter().filter(|series| !series.band.is_empty()) {
        curves.add_band(series, pen_of(pens, &series.label));
    }
    for series in &panel.series {
        curves.add_curve(series, pen_of(pens, &series.label));
    }
    // A cell without plots would vanish, axes and all.
    curves.plots.push(Plot::from(LinePlot::new()));
    let layout = with_marks(layout(panel, &curves), panel, marks);
    (curves.plots, layout)
}

/// A direction of the panel, along which values or their logarithms are drawn.
#[derive(Clone, Copy)]
struct Direction {
    logarithmic: bool,
    /// Range of what is drawn, in logarithms if the direction is logarithmic.
    range: Range,
}

impl Direction {
    fn new(logarithmic: bool) -> Self {
        Self { logarithmic, range: Range::EMPTY }
    }

    fn scale(self, value: f64) -> f64 {
        if self.logarithmic { value.log10() } else { value }
    }

    fn is_drawable(self, value: f64) -> bool {
        reach::drawable(value) && reach::drawable(self.scale(value))
    }

    fn include(&mut self, value: f64) {
        self.range.include(self.scale(value));
    }

    /// The limits to draw, as values.
    fn axis(self, margin: f64) -> Range {
        let axis = self.range.axis(margin);
        if self.logarithmic { axis.powers_of_ten() } else { axis }
    }
}

/// All that lies between the axes.
struct Curves {
    plots: Vec<Plot>,
    x: Direction,
    y: Direction,
    /// Lowest and highest y that are drawn, where not all are.
    limits: Option<[f64; 2]>,
    has_dots: bool,
}

impl Curves {
    fn new(panel: &Panel) -> Self {
        Self {
            plots: vec![],
            x: Direction::new(panel.logarithmic),
            y: Direction::new(panel.logarithmic && panel.rows.is_empty()),
            limits: reach::limits(panel),
            has_dots: false,
        }
    }

    fn add_band(&mut self, series: &Series, color: &str) {
        let of_band = series.band.iter().map(|&(x, low, high)| (x, (self.within(low), self.within(high))));
        let (x, (low, high)): (Vec<_>, (Vec<_>, Vec<_>)) = of_band.unzip();
        low.iter().chain(&high).for_each(|&y| self.y.include(y));
        self.plots.push(Plot::from(BandPlot::new(x, low, high).with_color(color).with_opacity(BAND_OPACITY)));
    }

    fn add_curve(&mut self, series: &Series, color: &str) {
        let (curve, dots) = (self.visible(&series.points), self.visible(&series.dots));
        for &(x, y) in curve.iter().chain(&dots) {
            self.x.include(x);
            self.y.include(y);
        }
        if curve.len() > 1 {
            let line = LinePlot::new().with_data(curve).with_color(color).with_stroke_width(LINE_WIDTH);
            self.plots.push(Plot::from(line));
        } else {
            // A line of one point has no length.
            self.add_dots(curve, color);
        }
        self.add_dots(dots, color);
        if let Some(limits) = self.limits {
            for (x, edge) in reach::beyond(series, limits) {
                let outward = if edge == limits[1] { MarkerShape::Triangle } else { MarkerShape::TriangleDown };
                self.plots.push(Plot::from(scatter(vec![(x, edge)], color).with_marker(outward)));
            }
        }
    }

    fn add_dots(&mut self, dots: Vec<(f64, f64)>, color: &str) {
        self.has_dots |= !dots.is_empty();
        self.plots.push(Plot::from(scatter(dots, color)));
    }

    /// The points that can be drawn, at the edge where they lie beyond it.
    fn visible(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let drawable = points.iter().filter(|(x, y)| self.x.is_drawable(*x) && self.y.is_drawable(*y));
        drawable.map(|&(x, y)| (x, self.within(y))).collect()
    }

    fn within(&self, y: f64) -> f64 {
        self.limits.map_or(y, |[low, high]| y.clamp(low, high))
    }

    /// The limits of both axes, as values.
    fn axes(&self, panel: &Panel) -> [Range; 2] {
        let (mut x, mut y) = (self.x, self.y);
        if !panel.rows.is_empty() {
            y.range.include(0.5);
            y.range.include(panel.rows.len() as f64 + 0.5);
        }
        if panel.from_zero {
            x.range.include(0.0);
            y.range.include(0.0);
        }
        if let Reach::Between(low, high) = panel.y_reach {
            y.range.include(low);
            y.range.include(high);
        }
        // Lines may end at the edge, but a dot there would be cut in half.
        [x.axis(if self.has_dots { 0.03 } else { 0.0 }), y.axis(0.04)]
    }
}

fn scatter(points: Vec<(f64, f64)>, color: &str) -> ScatterPlot {
    ScatterPlot::new().with_data(points).with_color(color).with_size(DOT_SIZE)
}

/// Axes, labels and title.
fn layout(panel: &Panel, curves: &Curves) -> Layout {
    let [x_axis, y_axis] = curves.axes(panel);
    let is_empty = curves.x.range == Range::EMPTY;
    let mut layout = Layout::new((x_axis.low, x_axis.high), (y_axis.low, y_axis.high))
        // kuva would otherwise round the limits outward, by up to a quarter of the panel.
        .with_x_axis_min(x_axis.low)
        .with_x_axis_max(x_axis.high)
        .with_y_axis_min(y_axis.low)
        .with_y_axis_max(y_axis.high)
        .with_x_tick_format(TickFormat::Custom(Arc::new(move |value| x_axis.tick_label(value))))
        .with_y_tick_format(TickFormat::Custom(Arc::new(move |value| y_axis.tick_label(value))))
        .with_ticks(6)
        .with_title(if is_empty { format!("{} (no data)", panel.title) } else { panel.title.clone() })
        .with_x_label(&panel.x_label)
        .with_x_label_offset(0.0, -5.0)
        .with_y_label(&panel.y_label)
        .with_title_size(TITLE_SIZE)
        .with_label_size(LABEL_SIZE)
        .with_tick_size(TICK_SIZE)
        .with_theme(Theme { grid_color: "#e4e4e4".into(), ..Theme::light() });
    if curves.x.logarithmic {
        layout = layout.with_log_x();
    }
    if curves.y.logarithmic {
        layout = layout.with_log_y();
    }
    if !panel.rows.is_empty() {
        layout = layout.with_y_categories(panel.rows.clone());
    }
    layout
}

/// Vertical lines at the panel's moments, in the colours that they have in all panels.
fn with_marks(layout: Layout, panel: &Panel, marks: &[&str]) -> Layout {
    panel.marks.iter().fold(layout, |layout, (label, x)| {
        let color = of_mark(marks.iter().position(|mark| mark == label).unwrap_or(0));
        let line = ReferenceLine::vertical(*x).with_color(color).with_stroke_width(LINE_WIDTH);
        // The default is dashed.
        layout.with_reference_line(line.with_dasharray(""))
    })
}
