//! Curves on paper: a grid of panels as SVG, and as PNG if wanted.
//!
//! Every call to `kuva`, a young crate, stays in this module, so that it can be replaced.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, ensure};
use kuva::RasterBackend;
use kuva::backend::svg::SvgBackend;
use kuva::render::figure::Figure;
use kuva::render::render::{Primitive, Scene};
use output::file;
use physics::camera::Image;

use crate::picture;

pub use forest::{Forest, Ratio, two_digits};
pub use heat_map::{HeatMap, HeatRow};

mod forest;
mod heat_map;
mod legend;
mod panel;
mod pens;
mod reach;

/// One curve.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// Name in the legend. The same label has the same colour in every panel, and the name of an action space in every figure.
    pub label: String,
    /// (x, y) in drawing order. Points that are not finite are left out.
    pub points: Vec<(f64, f64)>,
    /// A pale band around the curve: (x, low, high). The numbers must be finite.
    pub band: Vec<(f64, f64, f64)>,
    /// (x, y) of dots that belong to no curve.
    pub dots: Vec<(f64, f64)>,
}

impl Series {
    /// A curve without band and dots.
    pub fn new(label: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Series { label: label.into(), points, ..Series::default() }
    }
}

/// How far an axis reaches.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Reach {
    /// As far as all that is drawn.
    #[default]
    All,
    /// As far as most of the values. What lies far outside is cut off at the edge, where a triangle in its colour points outward.
    Most,
    /// From the first value to the second. What lies beyond is cut off as in [`Reach::Most`].
    Between(f64, f64),
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
    /// How far the y axis reaches.
    pub y_reach: Reach,
}

/// Size of one panel in SVG units: two by two of them are about 1000 x 700.
const PANEL: (f64, f64) = (490.0, 335.0);
const MARGIN: f64 = 8.0;
/// Pixels per SVG unit: sharp at 300 dpi across a page.
const PNG_SCALE: f32 = 2.0;
const FIGURE_TITLE_SIZE: u32 = 20;
const LABEL_SIZE: u32 = 15;
const LINE_WIDTH: f64 = 1.8;

/// Writes `PATH.svg`: a title, the panels in rows of two or three, one legend below them if any panel has several curves.
///
/// # Errors
/// If the disk does not take the file.
pub fn write(title: &str, panels: &[Panel], path_without_extension: &Path) -> Result<()> {
    write_svg(title, panels, &file::with_suffix(path_without_extension, ".svg")).map(drop)
}

/// Writes `PATH.svg`: ratios beside a line at one.
///
/// # Errors
/// If there is no ratio to draw, or the disk does not take the file.
pub fn write_forest(forest: &Forest, path_without_extension: &Path) -> Result<()> {
    ensure!(!forest.ratios.is_empty(), "no ratios to draw in {}", path_without_extension.display());
    file::replace(&file::with_suffix(path_without_extension, ".svg"), svg(&forest::draw(forest)).as_bytes())
}

/// Writes `PATH.svg`: shares as colours and numbers.
///
/// # Errors
/// If there is no share to draw, or the disk does not take the file.
pub fn write_heat_map(map: &HeatMap, path_without_extension: &Path) -> Result<()> {
    ensure!(!map.rows.is_empty(), "no shares to draw in {}", path_without_extension.display());
    file::replace(&file::with_suffix(path_without_extension, ".svg"), svg(&heat_map::draw(map)).as_bytes())
}

/// The path without the ending .svg or .png. In "seed_0.5" the dot belongs to the name.
pub fn without_picture_extension(path: &Path) -> PathBuf {
    let is_picture = path.extension().is_some_and(|extension| extension == "svg" || extension == "png");
    if is_picture { path.with_extension("") } else { path.into() }
}

/// The files that [`write_with_png`] writes.
pub fn files(path_without_extension: &Path) -> [PathBuf; 2] {
    [".svg", ".png"].map(|extension| file::with_suffix(path_without_extension, extension))
}

/// Writes `PATH.svg` as [`write()`] does, and the same picture as `PATH.png`.
///
/// # Errors
/// If the disk does not take the file.
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

/// The picture as SVG. kuva numbers the clipped regions over all pictures of a process. Here they are numbered within the picture, so that
/// the same panels give the same bytes.
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

/// Averages blocks of two by two pixels, because kuva draws upright text in PNGs without anti-aliasing, thick and ragged.
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
    let (labels, marks) = (legend::labels(panels), legend::mark_labels(panels));
    let pens = pens::pens(&once(panels.iter().flat_map(|panel| &panel.series).map(|series| series.label.as_str())));
    let (plots, layouts): (Vec<_>, Vec<_>) = panels.iter().map(|panel| panel::draw(panel, &pens, &marks)).unzip();
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
        of_label.all(|series| series.points.is_empty())
    };
    let curves = labels.iter().map(|label| (*label, pens::pen_of(&pens, label), dots(label)));
    let marks = marks.iter().enumerate().map(|(index, label)| (*label, pens::of_mark(index), false));
    legend::add(&mut scene, &curves.chain(marks).collect::<Vec<_>>());
    scene
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

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn panel(curves: &[&[(f64, f64)]]) -> Panel {
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
            let svg = std::fs::read_to_string(path.with_file_name("seed_0.5.svg")).unwrap();
            assert!(svg.contains("(no data)") && !svg.contains("NaN") && !svg.contains("inf"));
        }
        let mut names: Vec<_> = folder.path().read_dir().unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["seed_0.5.png", "seed_0.5.svg"]);
    }

    #[test]
    fn only_a_pictures_ending_is_taken_off() {
        for (path, stem) in [("a/x.svg", "a/x"), ("a/x.png", "a/x"), ("a/seed_0.5", "a/seed_0.5"), ("x", "x")] {
            assert_eq!(without_picture_extension(Path::new(path)), Path::new(stem));
        }
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
}
