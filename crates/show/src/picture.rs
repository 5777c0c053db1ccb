//! Pictures and films of the simulation: PNG and GIF.

use std::collections::HashMap;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use output::file::{finish, replace, unfinished};
use physics::camera::Image;
use tempfile::NamedTempFile;

/// Writes the picture as an 8-bit RGB PNG.
///
/// # Errors
/// If the disk does not take the file.
pub fn write_png(image: &Image, path: &Path) -> Result<()> {
    let describe = || format!("cannot encode {}", path.display());
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().with_context(describe)?;
    writer.write_image_data(&image.rgb).with_context(describe)?;
    writer.finish().with_context(describe)?;
    replace(path, &bytes)
}

/// A GIF film that repeats endlessly. The file appears under its name only with [`GifWriter::finish`].
pub struct GifWriter {
    path: PathBuf,
    encoder: gif::Encoder<BufWriter<NamedTempFile>>,
    frames_per_second: f64,
    frames: usize,
    /// What a viewer shows after the frames so far, in the colours of their palettes.
    shown: Image,
}

impl GifWriter {
    /// Starts a film of `width` x `height` pixels. Browsers slow down above 50 frames per second.
    ///
    /// # Errors
    /// If a GIF cannot have this size or rate, or the disk does not take the file.
    pub fn create(path: &Path, width: usize, height: usize, frames_per_second: f64) -> Result<Self> {
        let name = path.display();
        ensure!(
            frames_per_second > 0.0 && frames_per_second <= 50.0,
            "{name}: {frames_per_second} frames per second, at most 50"
        );
        let size = u16::try_from(width).ok().zip(u16::try_from(height).ok());
        let size = size.filter(|&(columns, rows)| columns > 0 && rows > 0);
        let (columns, rows) = size.with_context(|| format!("{name}: {width} x {height} pixels do not fit a GIF"))?;
        let file = BufWriter::new(unfinished(path)?);
        let mut encoder =
            gif::Encoder::new(file, columns, rows, &[]).with_context(|| format!("cannot start {name}"))?;
        encoder.set_repeat(gif::Repeat::Infinite).with_context(|| format!("cannot start {name}"))?;
        let shown = Image { width, height, rgb: Vec::new() };
        Ok(Self { path: path.to_owned(), encoder, frames_per_second, frames: 0, shown })
    }

    /// Appends a frame.
    ///
    /// # Errors
    /// If the frame has another size than the film, or the disk does not take it.
    pub fn push(&mut self, image: &Image) -> Result<()> {
        let fits = (image.width, image.height) == (self.shown.width, self.shown.height)
            && image.rgb.len() == 3 * image.width * image.height;
        ensure!(fits, "{}: a frame of {} x {} does not fit", self.path.display(), image.width, image.height);
        let mut frame = self.changes(image);
        // In hundredths of a second. As differences of rounded times, so that the rounding does not add up at 30 frames per second.
        let time = |frames: usize| (100.0 * frames as f64 / self.frames_per_second).round();
        frame.delay = (time(self.frames + 1) - time(self.frames)) as u16;
        self.encoder.write_frame(&frame).with_context(|| format!("cannot write to {}", self.path.display()))?;
        self.frames += 1;
        Ok(())
    }

    /// The smallest rectangle with all changed pixels, the unchanged ones transparent. It has a palette of its own: up to
    /// 256 colours are exact, and a still background does not flicker when a moving part brings new ones.
    fn changes(&mut self, image: &Image) -> gif::Frame<'static> {
        /// NeuQuant learns from every tenth pixel.
        const SPEED: i32 = 10;
        /// A smaller difference is not visible. A larger error of an earlier palette counts as a change and is corrected.
        const TOLERANCE: u8 = 4;
        let width = image.width;
        let (old, new) = (self.shown.rgb.as_chunks::<3>().0, image.rgb.as_chunks::<3>().0);
        let far = |a: &[u8; 3], b: &[u8; 3]| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > TOLERANCE);
        let changed: Vec<bool> =
            new.iter().enumerate().map(|(at, new)| old.get(at).is_none_or(|old| far(old, new))).collect();
        let (mut left, mut right, mut top, mut bottom) = (width, 0, image.height, 0);
        for at in (0..changed.len()).filter(|&at| changed[at]) {
            (left, right) = (left.min(at % width), right.max(at % width + 1));
            (top, bottom) = (top.min(at / width), bottom.max(at / width + 1));
        }
        if left >= right {
            // GIF has no empty frame, and a pause needs one.
            (left, right, top, bottom) = (0, 1, 0, 1);
        }
        let places = (top..bottom).flat_map(|row| (left..right).map(move |column| row * width + column));
        let mut rgba = Vec::with_capacity(4 * (right - left) * (bottom - top));
        for at in places.clone() {
            let [r, g, b] = new[at];
            rgba.extend(if changed[at] { [r, g, b, 255] } else { [0; 4] });
        }
        let mut frame = gif::Frame::from_rgba_speed((right - left) as u16, (bottom - top) as u16, &mut rgba, SPEED);
        (frame.left, frame.top) = (left as u16, top as u16);
        let palette = frame.palette.get_or_insert_default();
        sharpen(palette, &frame.buffer, &rgba);
        self.shown.rgb.resize(image.rgb.len(), 0);
        for (at, &index) in places.zip(frame.buffer.iter()).filter(|(at, _)| changed[*at]) {
            self.shown.rgb[3 * at..3 * at + 3].copy_from_slice(&palette[3 * usize::from(index)..][..3]);
        }
        frame
    }

    /// Completes the file and gives it its name.
    ///
    /// # Errors
    /// If there is no frame, or the disk does not take the file.
    pub fn finish(self) -> Result<()> {
        ensure!(self.frames > 0, "{}: no frames", self.path.display());
        let cannot = || format!("cannot finish {}", self.path.display());
        let file = self.encoder.into_inner().with_context(cannot)?;
        finish(file.into_inner().with_context(cannot)?, &self.path)
    }
}

/// Gives each palette entry the colour that most of its pixels have, if there is one. NeuQuant's averages miss the true
/// colour of a plain background by a little, and every moving part would leave a ghost where it uncovers it.
fn sharpen(palette: &mut [u8], indices: &[u8], rgba: &[u8]) {
    let mut totals = [0; 256];
    let mut counts = HashMap::<(u8, &[u8]), usize>::new();
    for (&index, pixel) in indices.iter().zip(rgba.chunks_exact(4)).filter(|(_, pixel)| pixel[3] > 0) {
        totals[usize::from(index)] += 1;
        *counts.entry((index, &pixel[..3])).or_default() += 1;
    }
    for ((index, color), _) in counts.iter().filter(|((index, _), count)| 2 * **count > totals[usize::from(*index)]) {
        palette[3 * usize::from(*index)..][..3].copy_from_slice(color);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wide ramp of colours, more than one palette holds, with a dark bar that moves.
    fn picture(bar: usize) -> Image {
        let mut image = Image { width: 64, height: 48, rgb: Vec::new() };
        for at in 0..64 * 48 {
            let (x, y) = (at % 64, at / 64);
            image.rgb.extend(if (bar..bar + 8).contains(&x) { [9, 9, 9] } else { [4 * x as u8, 5 * y as u8, 128] });
        }
        image
    }

    #[test]
    fn a_film_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.gif");
        let frames = [picture(3), picture(3), picture(30)];
        let mut film = GifWriter::create(&path, 64, 48, 30.0).unwrap();
        frames.iter().for_each(|frame| film.push(frame).unwrap());
        assert!(film.push(&Image { width: 1, height: 1, rgb: vec![0; 3] }).is_err());
        assert!(!path.exists());
        film.finish().unwrap();

        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(std::fs::File::open(&path).unwrap()).unwrap();
        let mut canvas = vec![[0; 3]; 64 * 48];
        let mut delays = Vec::new();
        for expected in &frames {
            let frame = decoder.read_next_frame().unwrap().unwrap();
            delays.push(frame.delay);
            for (at, pixel) in frame.buffer.chunks_exact(4).enumerate().filter(|(_, pixel)| pixel[3] > 0) {
                let (x, y) = (at % usize::from(frame.width), at / usize::from(frame.width));
                let place = (y + usize::from(frame.top)) * 64 + x + usize::from(frame.left);
                canvas[place].copy_from_slice(&pixel[..3]);
            }
            let error: u32 =
                canvas.as_flattened().iter().zip(&expected.rgb).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
            assert!(error < 8 * 3 * 64 * 48, "mean error {}", f64::from(error) / (3.0 * 64.0 * 48.0));
        }
        assert_eq!(delays, [3, 4, 3]);
    }

    #[test]
    fn impossible_films_are_refused_by_name() {
        for (width, frames_per_second) in [(70_000, 20.0), (0, 20.0), (64, 0.0), (64, f64::NAN)] {
            let error = GifWriter::create(Path::new("x.gif"), width, 48, frames_per_second).err().unwrap();
            assert!(error.to_string().contains("x.gif"));
        }
    }

    #[test]
    fn a_png_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        write_png(&picture(5), &path).unwrap();
        let bytes = fs_err::read(&path).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgb).unwrap();
        assert_eq!(rgb, picture(5).rgb);
    }
}
