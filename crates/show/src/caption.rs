//! A line of text in a picture, or below it.

use physics::camera::Image;

const PAPER: [u8; 3] = [250, 250, 250];
const INK: [u8; 3] = [30, 30, 30];
/// Dots of a strip of text from top to bottom: those of a glyph, and one of paper above and below.
const STRIP: usize = 11;

/// Writes one line of ASCII text at the top left, dark on a light strip.
pub fn caption(image: &mut Image, text: &str) {
    // Two pixels per dot in 360 rows, fewer where the line would not fit.
    let scale = (image.height / 180).min(image.width / dots(text)).max(1);
    letters(image, text, scale);
}

/// The picture with one line of ASCII text on a light strip below or above it, in letters of which `fitting` fit side
/// by side.
pub fn with_strip(image: &Image, text: &str, fitting: usize, below: bool) -> Image {
    let scale = (image.width / (6 * fitting + 1)).min(image.width / dots(text)).max(1);
    let mut strip = Image { height: STRIP * scale, rgb: PAPER.repeat(STRIP * scale * image.width), ..*image };
    letters(&mut strip, text, scale);
    let parts = if below { [image, &strip] } else { [&strip, image] };
    Image { height: image.height + strip.height, rgb: parts.map(|part| part.rgb.as_slice()).concat(), ..*image }
}

/// Writes one line of ASCII text on a light strip across the top, in letters twice as large as those of [`caption`]
/// where they fit. Below the strip it draws a line of the `color`, "#rrggbb".
pub fn heading(image: &mut Image, text: &str, color: Option<&str>) {
    let scale = (image.height / 90).min(image.width / dots(text)).max(1);
    let row = 3 * image.width;
    let (strip, line) = ((STRIP * scale).min(image.height), ((STRIP + 2) * scale).min(image.height));
    image.rgb[..strip * row].as_chunks_mut::<3>().0.fill(PAPER);
    let hex = |at: usize| color.and_then(|color| u8::from_str_radix(color.get(at..at + 2)?, 16).ok());
    if let (Some(r), Some(g), Some(b)) = (hex(1), hex(3), hex(5)) {
        image.rgb[strip * row..line * row].as_chunks_mut::<3>().0.fill([r, g, b]);
    }
    letters(image, text, scale);
}

/// Width of a text in dots.
fn dots(text: &str) -> usize {
    6 * text.len() + 1
}

/// Draws a text; each dot is `scale` pixels wide and high.
fn letters(image: &mut Image, text: &str, scale: usize) {
    let dots = dots(text);
    for row in 0..(STRIP * scale).min(image.height) {
        for column in 0..(dots * scale).min(image.width) {
            // One dot of paper around each glyph of 5 x 9.
            let (x, y) = (column / scale, row / scale);
            let glyph = text.as_bytes().get(x / 6).map_or(0, |&byte| glyph(byte));
            let inside = x % 6 > 0 && (1..STRIP - 1).contains(&y);
            let ink = inside && glyph >> (45 - 5 * (y - 1) - x % 6) & 1 == 1;
            let at = 3 * (row * image.width + column);
            image.rgb[at..at + 3].copy_from_slice(if ink { &INK } else { &PAPER });
        }
    }
}

/// 45 dots, rows from the top, leftmost first, the last dot in the lowest bit. The last two rows are below the baseline.
fn glyph(byte: u8) -> u64 {
    match byte {
        b'g' => 0x0003e318bc2e,
        b'j' => 0x020184210a4c,
        b'p' => 0x0007a318fa10,
        b'q' => 0x0003e318bc21,
        b'y' => 0x00046318bc2e,
        b' '..=b'~' => FONT[usize::from(byte - b' ')] << 10,
        _ => glyph(b'?'),
    }
}

/// Space to tilde, drawn for this file: the seven rows above the baseline.
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

    #[test]
    fn captions_fit_any_picture() {
        for (width, height) in [(640, 480), (20, 5), (1, 1), (0, 0)] {
            let mut image = Image { width, height, rgb: vec![100; 3 * width * height] };
            caption(&mut image, "t 1.25 s, α\u{7f}");
            caption(&mut image, "");
            heading(&mut image, "t 1.25 s", Some("#0072b2"));
        }
        let mut image = Image { width: 8, height: 11, rgb: vec![100; 3 * 88] };
        caption(&mut image, "L");
        let ink = |row: usize, column: usize| image.rgb[3 * (8 * row + column)] == 30;
        assert!((1..8).all(|row| ink(row, 1)) && (1..6).all(|column| ink(7, column)) && !ink(1, 2) && !ink(8, 1));
    }

    #[test]
    fn small_letters_hang_below_the_line_and_capitals_do_not() {
        let below_line = |letter: u8| glyph(letter) & 0b11111_11111 > 0;
        assert_eq!((b'!'..=b'~').filter(|&letter| below_line(letter)).collect::<Vec<_>>(), b"gjpqy");
    }

    #[test]
    fn a_strip_stands_above_or_below_the_whole_picture() {
        let image = Image { width: 40, height: 30, rgb: vec![100; 3 * 1200] };
        for (below, at) in [(true, 0), (false, 11)] {
            let with = with_strip(&image, "2 s", 6, below);
            assert_eq!((with.width, with.height, with.rgb.len()), (40, 41, 3 * 40 * 41));
            assert_eq!(with.rgb[3 * 40 * at..][..image.rgb.len()], image.rgb);
            assert!(with.rgb.contains(&30), "letters");
        }
    }
}
