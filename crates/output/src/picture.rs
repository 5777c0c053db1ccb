//! Pictures and films of the simulation: PNG, GIF, and a caption drawn into them.

use std::collections::HashMap;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use fs_err as fs;
use physics::camera::Image;

use crate::file::{replace, unfinished};

/// Writes the picture as an 8-bit RGB PNG.
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

/// An endless film. Nothing appears under its name before [`GifWriter::finish`].
pub struct GifWriter {
    path: PathBuf,
    encoder: gif::Encoder<BufWriter<fs::File>>,
    frames_per_second: f64,
    frames: usize,
    /// What a viewer shows by now, up to the loss of colours.
    shown: Image,
}

impl GifWriter {
    /// Starts a film of `width` x `height` pixels. Browsers slow down above 50 frames per second.
    pub fn create(path: &Path, width: usize, height: usize, frames_per_second: f64) -> Result<Self> {
        let name = path.display();
        ensure!(
            frames_per_second > 0.0 && frames_per_second <= 50.0,
            "{name}: {frames_per_second} frames per second, at most 50"
        );
        let size = u16::try_from(width).ok().zip(u16::try_from(height).ok());
        let size = size.filter(|&(columns, rows)| columns > 0 && rows > 0);
        let (columns, rows) = size.with_context(|| format!("{name}: {width} x {height} pixels do not fit a GIF"))?;
        let file = BufWriter::new(fs::File::create(unfinished(path))?);
        let mut encoder =
            gif::Encoder::new(file, columns, rows, &[]).with_context(|| format!("cannot start {name}"))?;
        encoder.set_repeat(gif::Repeat::Infinite).with_context(|| format!("cannot start {name}"))?;
        let shown = Image { width, height, rgb: Vec::new() };
        Ok(Self { path: path.to_owned(), encoder, frames_per_second, frames: 0, shown })
    }

    /// Appends a frame.
    pub fn push(&mut self, image: &Image) -> Result<()> {
        let fits = (image.width, image.height) == (self.shown.width, self.shown.height)
            && image.rgb.len() == 3 * image.width * image.height;
        ensure!(fits, "{}: a frame of {} x {} does not fit", self.path.display(), image.width, image.height);
        let mut frame = self.changes(image);
        // In hundredths of a second; differences of rounded times, so that 30 frames per second keep in time.
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
        /// Nobody sees a smaller difference, and what an earlier palette got wrong by more is mended.
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
    pub fn finish(self) -> Result<()> {
        ensure!(self.frames > 0, "{}: no frames", self.path.display());
        let mut file = self.encoder.into_inner().with_context(|| format!("cannot finish {}", self.path.display()))?;
        file.flush()?;
        fs::rename(unfinished(&self.path), &self.path)?;
        Ok(())
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

/// Writes one line of ASCII text at the top left, dark on a light strip.
pub fn caption(image: &mut Image, text: &str) {
    const PAPER: [u8; 3] = [250, 250, 250];
    const INK: [u8; 3] = [30, 30, 30];
    let dots = 6 * text.len() + 1;
    // Two pixels per dot in 360 rows, fewer where the line would not fit.
    let scale = (image.height / 180).min(image.width / dots).max(1);
    for row in 0..(9 * scale).min(image.height) {
        for column in 0..(dots * scale).min(image.width) {
            // One dot of paper around each glyph of 5 x 7.
            let (x, y) = (column / scale, row / scale);
            let glyph = text.as_bytes().get(x / 6).map_or(0, |&byte| glyph(byte));
            let inside = x % 6 > 0 && (1..8).contains(&y);
            let ink = inside && glyph >> (35 - 5 * (y - 1) - x % 6) & 1 == 1;
            let at = 3 * (row * image.width + column);
            image.rgb[at..at + 3].copy_from_slice(if ink { &INK } else { &PAPER });
        }
    }
}

/// 35 dots, rows from the top, leftmost first, the last dot in the lowest bit.
fn glyph(byte: u8) -> u64 {
    FONT[usize::from(if (b' '..=b'~').contains(&byte) { byte } else { b'?' } - b' ')]
}

/// Space to tilde, drawn for this file.
#[rustfmt::skip]
const FONT: [u64; 95] = [
    0x000000000, 0x108421004, 0x294a00000, 0x295f57d4a, 0x11f4717c4, 0x672222273, 0x325264e4d, 0x108400000, 0x088842082,
    0x208210888, 0x02aefbaa0, 0x0084f9080, 0x000001888, 0x0000f8000, 0x00000018c, 0x042222210, 0x3a33ae62e, 0x11942109f,
    0x3a213221f, 0x3a213062e, 0x08ca97c42, 0x7e1e0862e, 0x1910f462e, 0x7c2211084, 0x3a317462e, 0x3a317844c, 0x018c03180,
    0x018c03088, 0x088882082, 0x001f07c00, 0x208208888, 0x3a2111004, 0x3a37ade0e, 0x11518fe31, 0x7a31f463e, 0x3a308422e,
    0x72518c65c, 0x7e10f421f, 0x7e10f4210, 0x3a30bc62f, 0x4631fc631, 0x38842108e, 0x1c4210a4c, 0x4654c5251, 0x42108421f,
    0x4775ac631, 0x4739ace71, 0x3a318c62e, 0x7a31f4210, 0x3a318d64d, 0x7a31f5251, 0x3e107043e, 0x7c8421084, 0x46318c62e,
    0x463152944, 0x4631ad6aa, 0x462a22a31, 0x462a21084, 0x7c222221f, 0x39084210e, 0x420820821, 0x38421084e, 0x115100000,
    0x00000001f, 0x208000000, 0x000e0be2f, 0x421e8c63e, 0x000f8420f, 0x042f8c62f, 0x000e8fe0f, 0x191e42108, 0x01f18bc2e,
    0x421e8c631, 0x100c2108e, 0x080610a4c, 0x4212a6292, 0x30842108e, 0x001aad6b5, 0x001e8c631, 0x000e8c62e, 0x03d18fa10,
    0x01f18bc21, 0x0016cc210, 0x000f8383e, 0x211e42106, 0x00118c62f, 0x00118a944, 0x0011ad6aa, 0x001151151, 0x02318bc2e,
    0x001f1111f, 0x088441082, 0x108421084, 0x208411088, 0x0008a8800,
];

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
        let bytes = fs::read(&path).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgb).unwrap();
        assert_eq!(rgb, picture(5).rgb);
    }

    #[test]
    fn captions_fit_any_picture() {
        for (width, height) in [(640, 480), (20, 5), (1, 1), (0, 0)] {
            let mut image = Image { width, height, rgb: vec![100; 3 * width * height] };
            caption(&mut image, "t 1.25 s, α\u{7f}");
            caption(&mut image, "");
        }
        let mut image = Image { width: 8, height: 9, rgb: vec![100; 3 * 72] };
        caption(&mut image, "L");
        let ink = |row: usize, column: usize| image.rgb[3 * (8 * row + column)] == 30;
        assert!((1..8).all(|row| ink(row, 1)) && (1..6).all(|column| ink(7, column)) && !ink(1, 2) && !ink(8, 1));
    }
}
