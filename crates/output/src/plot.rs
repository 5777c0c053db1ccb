//! Curves on paper: a grid of panels as SVG, and as PNG if wanted.
//!
//! Every call to `kuva`, a young crate, stays in this file, so that it can be replaced.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, ensure};
use kuva::RasterBackend;
use kuva::TickFormat;
use kuva::backend::svg::SvgBackend;
use kuva::plot::{BandPlot, LinePlot, LineStyle, ScatterPlot};
use kuva::render::annotations::ReferenceLine;
use kuva::render::figure::Figure;
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::render::{Primitive, Scene, TextAnchor};
use kuva::render::theme::Theme;
use physics::camera::Image;

use crate::axis::Range;
use crate::palette::{self, OTHERS};
use crate::{file, picture};

/// One curve.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// What the legend calls it. The same label has the same colour in every panel; an action space's name has it in every
    /// figure.
    pub label: String,
    /// (x, y) in drawing order. Points that are not finite are left out.
    pub points: Vec<(f64, f64)>,
    /// Around the curve, pale: (x, low, high). Must be finite.
    pub band: Vec<(f64, f64, f64)>,
    /// What the curve sums up, one thin line each.
    pub members: Vec<Vec<(f64, f64)>>,
}

impl Series {
    /// A curve that stands for itself.
    pub fn new(label: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Series { label: label.into(), points, ..Series::default() }
    }
}

/// One pair of axes with its curves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// Above the axes.
    pub title: String,
    /// Quantity and unit, below the axes.
    pub x_label: String,
    /// Quantity and unit, left of the axes.
    pub y_label: String,
    /// The curves; later ones are drawn over earlier ones.
    pub series: Vec<Series>,
    /// Moments: label and x of vertical lines.
    pub marks: Vec<(String, f64)>,
    /// Names of what lies at y = 1, 2 and so on, from below; the y axis has no other ticks then.
    pub rows: Vec<String>,
    /// Both axes are logarithmic; with `rows`, the x axis.
    pub logarithmic: bool,
    /// Zero belongs to both axes.
    pub from_zero: bool,
}

/// Size of one panel in SVG units: two by two of them are about 1000 x 700.
const PANEL: (f64, f64) = (490.0, 335.0);
const MARGIN: f64 = 8.0;
/// Pixels per SVG unit: sharp at 300 dpi across a page.
const PNG_SCALE: f32 = 2.0;
const FIGURE_TITLE_SIZE: u32 = 20;
const TITLE_SIZE: u32 = 17;
const LABEL_SIZE: u32 = 15;
const TICK_SIZE: u32 = 13;
const LINE_WIDTH: f64 = 1.8;
const MEMBER_WIDTH: f64 = 0.6;
/// How much of a member's colour is white: what sums the members up stands out.
const MEMBER_PALENESS: f64 = 0.6;
const BAND_OPACITY: f64 = 0.18;

/// The lines of the first and the second label of marks, and so on.
const MARKS: [(&str, LineStyle); 2] = [("#c0c0c0", LineStyle::Solid), ("#808080", LineStyle::Solid)];

/// Writes `PATH.svg`: a title, the panels in rows of two or three, one legend below them if any panel has several curves.
pub fn write(title: &str, panels: &[Panel], path_without_extension: &Path) -> Result<()> {
    write_svg(title, panels, &file::with_suffix(path_without_extension, ".svg")).map(drop)
}

/// The files that [`write_with_png`] writes.
pub fn files(path_without_extension: &Path) -> [PathBuf; 2] {
    [".svg", ".png"].map(|extension| file::with_suffix(path_without_extension, extension))
}

/// Writes `PATH.svg` as [`write()`] does, and the same picture as `PATH.png`.
pub fn write_with_png(title: &str, panels: &[Panel], path_without_extension: &Path) -> Result<()> {
    let [svg_path, png_path] = files(path_without_extension);
    let scene = write_svg(title, panels, &svg_path)?;
    let png = RasterBackend::new().with_scale(2.0 * PNG_SCALE).render_scene(&scene);
    let png = png.map_err(|reason| anyhow!("cannot draw {}: {reason}", png_path.display()))?;
    picture::write_png(&halved(&png)?, &png_path)
}

fn write_svg(title: &str, panels: &[Panel], path: &Path) -> Result<Scene> {
    ensure!(!panels.is_empty(), "no panels to draw in {}", path.display());
    let scene = draw(title, panels);
    file::replace(path, svg(&scene).as_bytes())?;
    Ok(scene)
}

/// kuva counts clipped regions over all pictures of a process. Counted within this one, the same panels are the same bytes.
fn svg(scene: &Scene) -> String {
    let mut text = SvgBackend::new().render_scene(scene);
    let regions = scene.elements.iter().filter_map(|element| match element {
        Primitive::ClipStart { id, .. } => Some(id),
        _ => None,
    });
    for (index, id) in regions.enumerate() {
        for (before, after) in [("id=\"", "\""), ("url(#", ")")] {
            text = text.replace(&format!("{before}{id}{after}"), &format!("{before}region-{index}{after}"));
        }
    }
    text
}

/// Averages blocks of two by two pixels: kuva's PNGs have upright text only without anti-aliasing, thick and ragged.
fn halved(png: &[u8]) -> Result<Image> {
    let mut reader = png::Decoder::new(Cursor::new(png)).read_info()?;
    let mut pixels = vec![0; reader.output_buffer_size().context("picture too large")?];
    let frame = reader.next_frame(&mut pixels)?;
    ensure!(frame.bit_depth == png::BitDepth::Eight, "unexpected bit depth {:?}", frame.bit_depth);
    let (width, height) = (frame.width as usize / 2, frame.height as usize / 2);
    let (next, below) = (frame.color_type.samples(), frame.line_size);
    let mut rgb = Vec::with_capacity(3 * width * height);
    for block in (0..height).flat_map(|row| (0..width).map(move |column| 2 * (row * below + column * next))) {
        for at in block..block + 3 {
            let sum: u16 = [at, at + next, at + below, at + below + next].iter().map(|&at| u16::from(pixels[at])).sum();
            rgb.push((sum / 4) as u8);
        }
    }
    Ok(Image { width, height, rgb })
}

fn draw(title: &str, panels: &[Panel]) -> Scene {
    // Three in a row leave no hole.
    let columns = if panels.len() == 3 { 3 } else { panels.len().min(2) };
    let rows = panels.len().div_ceil(columns);
    let (labels, marks) = (legend_labels(panels), mark_labels(panels));
    let pens = pens(&once(panels.iter().flat_map(|panel| &panel.series).map(|series| series.label.as_str())));
    let (plots, layouts): (Vec<_>, Vec<_>) = panels.iter().map(|panel| draw_panel(panel, &pens, &marks)).unzip();
    let mut scene = Figure::new(rows, columns)
        .with_title(title)
        .with_title_size(FIGURE_TITLE_SIZE)
        .with_cell_size(PANEL.0, PANEL.1)
        .with_spacing(MARGIN)
        .with_padding(MARGIN)
        .with_plots(plots)
        .with_layouts(layouts)
        .render();
    let dots = |label: &str| {
        let mut of_label = panels.iter().flat_map(|panel| &panel.series).filter(|series| series.label == label);
        of_label.all(|series| series.points.is_empty() && series.members.iter().all(|points| points.len() == 1))
    };
    let curves = labels.iter().map(|label| (*label, pen_of(&pens, label), dots(label)));
    let marks = marks.iter().enumerate().map(|(index, label)| (*label, mark_pen(index), false));
    add_legend(&mut scene, &curves.chain(marks).collect::<Vec<_>>());
    scene
}

/// Every label once, in order of appearance; none where no panel has two curves to tell apart.
fn legend_labels(panels: &[Panel]) -> Vec<&str> {
    if panels.iter().all(|panel| panel.series.len() < 2) {
        return vec![];
    }
    once(panels.iter().flat_map(|panel| &panel.series).map(|series| series.label.as_str()))
}

/// Every label of a mark once.
fn mark_labels(panels: &[Panel]) -> Vec<&str> {
    once(panels.iter().flat_map(|panel| &panel.marks).map(|(label, _)| label.as_str()))
}

fn once<'a>(all: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut labels = vec![];
    for label in all {
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels
}

/// Colour and line style.
type Pen = (&'static str, LineStyle);

/// Of the n-th mark.
fn mark_pen(index: usize) -> Pen {
    MARKS[index % MARKS.len()].clone()
}

/// Of every label: an action space's own colour; for the others those that no space of this figure has, and other line styles
/// once they are used up.
fn pens<'a>(labels: &[&'a str]) -> Vec<(&'a str, Pen)> {
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

fn pen_of(pens: &[(&str, Pen)], label: &str) -> Pen {
    pens.iter().find(|(known, _)| *known == label).expect("every label has a pen").1.clone()
}

/// A colour `#rrggbb`, nearer to white.
fn pale(color: &str) -> String {
    let mixed = |at: usize| {
        let value = u8::from_str_radix(&color[at..at + 2], 16).expect("a colour of the palette");
        (f64::from(value) + MEMBER_PALENESS * (255.0 - f64::from(value))).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", mixed(1), mixed(3), mixed(5))
}

fn draw_panel(panel: &Panel, pens: &[(&str, Pen)], marks: &[&str]) -> (Vec<Plot>, Layout) {
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
        let (color, _) = pen_of(pens, &series.label);
        plots.push(Plot::from(BandPlot::new(x, low, high).with_color(color).with_opacity(BAND_OPACITY)));
    }
    // Members lie below what sums them up, whichever it is; where nothing does, they are what is shown.
    let members = panel.series.iter().flat_map(|series| {
        let (color, style) = pen_of(pens, &series.label);
        let color = if series.points.is_empty() { color.into() } else { pale(color) };
        series.members.iter().map(move |points| (points, MEMBER_WIDTH, color.clone(), style.clone()))
    });
    let sums = panel.series.iter().map(|series| {
        let (color, style) = pen_of(pens, &series.label);
        (&series.points, LINE_WIDTH, color.to_string(), style)
    });
    for (points, width, color, style) in members.chain(sums) {
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
            let line = LinePlot::new().with_data(points).with_color(color).with_stroke_width(width);
            Plot::from(line.with_line_style(style))
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
        let (color, style) = mark_pen(marks.iter().position(|mark| mark == label).unwrap_or(0));
        let line = ReferenceLine::vertical(*x).with_color(color).with_stroke_width(LINE_WIDTH);
        layout = layout.with_reference_line(line.with_dasharray(style.dasharray().unwrap_or_default()));
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

/// Adds a strip below the panels with the labels side by side, in as many rows as they need: a dash or a dot, and the label.
fn add_legend(scene: &mut Scene, labels: &[(&str, Pen, bool)]) {
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
    for (index, (label, (color, style), dot)) in labels.iter().enumerate() {
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
                stroke_dasharray: style.dasharray(),
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

    fn panel(curves: &[&[(f64, f64)]]) -> Panel {
        let series = |(index, points): (usize, &&[(f64, f64)])| Series::new(format!("s{index}"), points.to_vec());
        Panel { series: curves.iter().enumerate().map(series).collect(), ..Panel::default() }
    }

    #[test]
    fn odd_data_is_drawn_and_overwrites_whole_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("seed_0.5");
        let nan = [(0.0, f64::NAN), (f64::NEG_INFINITY, 1.0), (1.0, 1.0), (2.0, f64::MAX), (3.0, -2.0)];
        let panels = [
            panel(&[]),
            panel(&[&[], &[(5.0, 3.0)]]),
            panel(&[&nan, &[(0.0, f64::NAN)]]),
            panel(&[&[(0.0, 4.0), (1e6, 4.0)], &[(1.0, 4.0), (1.0, 4.0)]]),
            panel(&[&[(0.0, -1e99), (1e-300, 1e99)]]),
        ];
        for count in [panels.len(), 1] {
            write_with_png("odd", &panels[..count], &path).unwrap();
        }
        let mut names: Vec<_> = folder.path().read_dir().unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["seed_0.5.png", "seed_0.5.svg"]);
        let svg = std::fs::read_to_string(path.with_file_name("seed_0.5.svg")).unwrap();
        assert!(svg.contains("(no data)") && !svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn the_same_panels_are_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let panels = [panel(&[&[(0.0, 4.0), (1.0, 5.0)]]), panel(&[&[(1.0, 3.0)]])];
        let [first, second] = ["first", "second"].map(|name| {
            write("", &panels, &folder.path().join(name)).unwrap();
            assert!(!folder.path().join(name).with_extension("png").exists());
            std::fs::read_to_string(folder.path().join(name).with_extension("svg")).unwrap()
        });
        assert!(first == second && first.contains("url(#region-1)"));
    }

    #[test]
    fn errors_name_the_path() {
        assert!(write("", &[], Path::new("nowhere/curves")).unwrap_err().to_string().contains("nowhere/curves"));
        assert!(
            write("", &[panel(&[])], Path::new("/nowhere/curves")).unwrap_err().to_string().contains("/nowhere/curves")
        );
    }

    #[test]
    fn a_space_keeps_its_colour_whatever_else_is_drawn() {
        let pens = pens(&["mine", "variable", "AFORCE", "yours"]);
        let colors: Vec<&str> = pens.iter().map(|(_, (color, _))| *color).collect();
        assert_eq!(colors, ["#009e73", "#d55e00", "#0072b2", "#cc79a7"]);
        assert_eq!(pale("#0072b2"), "#99c7e0");
    }

    #[test]
    fn a_legend_only_where_curves_must_be_told_apart() {
        let line: &[_] = &[(0.0, 0.0), (1.0, 1.0)];
        assert!(legend_labels(&[panel(&[line]), panel(&[line])]).is_empty());
        assert_eq!(legend_labels(&[panel(&[line]), panel(&[line, line])]), ["s0", "s1"]);
    }
}
