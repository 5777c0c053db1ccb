//! A contact sheet: the moments of an episode in one picture.

use physics::camera::Image;

use crate::caption::with_strip;
use crate::playback::Playback;

/// Moments on a sheet.
const TILES: u32 = 12;
const COLUMNS: usize = 4;
/// White between tiles (pixels).
const GAP: usize = 4;

/// How long a sheet goes on after the task is done (s).
const AFTER: f64 = 2.0;

/// The last action on the sheet of an episode: two seconds after the task is first done, or where the episode ends.
pub fn last_action(playback: &Playback) -> u32 {
    let actions = playback.traces.actions();
    let first = playback.episode.outcome().number("time_to_success_s");
    first.map_or(actions, |first| ((first + AFTER) * playback.rate).round() as u32).min(actions)
}

/// The tiles below a line that says whose episode it is and when the task was done; `None` without tiles.
pub fn titled(tiles: &[Image], playback: &Playback) -> Option<Image> {
    let done = match playback.episode.outcome().number("time_to_success_s") {
        Some(first) => format!("task done at {first:.2} s"),
        None => format!("task not done in {:.2} s", playback.traces.time()),
    };
    Some(with_strip(&compose(tiles)?, &format!("{}: {done}", playback.title), 80, false))
}

/// Whether the moment after `action` of `actions` (from 1) is on the sheet: the first, the last, and
/// evenly between.
pub fn shows(action: u32, actions: u32) -> bool {
    (0..TILES).any(|tile| action == 1 + tile * (actions - 1) / (TILES - 1))
}

/// The tiles, all of one size, row by row; `None` without tiles.
pub fn compose(tiles: &[Image]) -> Option<Image> {
    let Image { width: tile_width, height: tile_height, .. } = *tiles.first()?;
    let columns = COLUMNS.min(tiles.len());
    let rows = tiles.len().div_ceil(columns);
    let (width, height) = (columns * (tile_width + GAP) - GAP, rows * (tile_height + GAP) - GAP);
    let mut rgb = vec![255; 3 * width * height];
    for (index, tile) in tiles.iter().enumerate() {
        let (left, top) = (index % columns * (tile_width + GAP), index / columns * (tile_height + GAP));
        for (row, pixels) in tile.rgb.chunks_exact(3 * tile_width).enumerate() {
            rgb[3 * ((top + row) * width + left)..][..pixels.len()].copy_from_slice(pixels);
        }
    }
    Some(Image { width, height, rgb })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_and_last_moments_are_shown() {
        let shown = |actions| (1..=actions).filter(|&a| shows(a, actions)).collect::<Vec<_>>();
        assert_eq!(shown(500).len(), 12);
        assert_eq!((shown(500)[0], shown(500)[11]), (1, 500));
        assert_eq!(shown(3), [1, 2, 3]);
        assert_eq!(shown(1), [1]);
    }

    #[test]
    fn tiles_stand_row_by_row() {
        let tile = |grey| Image { width: 3, height: 2, rgb: vec![grey; 18] };
        let sheet = compose(&[tile(1), tile(2), tile(3), tile(4), tile(5)]).unwrap();
        assert_eq!((sheet.width, sheet.height), (24, 8));
        let grey = |row: usize, column: usize| sheet.rgb[3 * (24 * row + column)];
        assert_eq!([grey(0, 0), grey(1, 2), grey(0, 3), grey(0, 7), grey(1, 23)], [1, 1, 255, 2, 4]);
        assert_eq!([grey(6, 0), grey(7, 2), grey(6, 7)], [5, 5, 255]);
        assert!(compose(&[]).is_none());
    }
}
