//! Picture, contact sheet and animation of an episode while it is played.

use std::iter;

use anyhow::Result;
use physics::camera::Image;
use show::picture::{GifWriter, write_png};
use show::{Playback, sheet};
use tasks::{Env, Step};

use super::Arguments;

impl Arguments {
    /// Whether the animation shows the present moment.
    fn is_filmed(&self, playback: &Playback) -> bool {
        (playback.traces.actions() - 1).is_multiple_of(self.every)
    }

    /// Width and height of a picture.
    fn size(&self) -> (usize, usize) {
        (usize::from(self.width), usize::from(self.width) * 3 / 4)
    }

    /// A labelled picture of the present moment, to be shown beside the other episode's.
    fn labelled(&self, env: &Env, playback: &Playback) -> Image {
        let (width, height) = self.size();
        playback.labelled_picture(env, self.view, width, height, self.speed)
    }
}

/// The ray-cast pictures that were asked for.
pub(super) struct Pictures<'a> {
    arguments: &'a Arguments,
    /// The last action on the contact sheet.
    pub sheet_end: u32,
    tiles: Vec<Image>,
    /// The second episode's part of the animation.
    beside: Vec<Image>,
    film: Option<Film>,
}

/// An animation that is being written.
struct Film {
    writer: GifWriter,
    frames: usize,
    /// The first episode's last picture, which stays while the second goes on.
    last: Image,
}

impl<'a> Pictures<'a> {
    pub fn new(arguments: &'a Arguments) -> Self {
        Self { arguments, sheet_end: 0, tiles: vec![], beside: vec![], film: None }
    }

    /// Keeps the present moment of the second episode for the animation.
    pub fn add_beside(&mut self, env: &Env, playback: &Playback) {
        if self.arguments.gif.is_some() && self.arguments.is_filmed(playback) {
            self.beside.push(self.arguments.labelled(env, playback));
        }
    }

    /// Adds the present moment to the pictures that were asked for.
    pub fn add(&mut self, env: &Env, step: &Step, playback: &Playback) -> Result<()> {
        let Arguments { png, sheet, gif, view, every, speed, .. } = self.arguments;
        let (width, height) = self.arguments.size();
        let picture = || playback.picture(env, step, *view, width, height);
        let (actions, last) =
            (playback.traces.actions(), self.arguments.actions.unwrap_or(u32::MAX).min(env.config().horizon));
        if let Some(path) = gif.as_ref().filter(|_| self.arguments.is_filmed(playback)) {
            let alone = self.beside.is_empty();
            let last = if alone { picture() } else { self.arguments.labelled(env, playback) };
            let frames = self.film.as_ref().map_or(0, |film| film.frames);
            let frame = pair(&last, &self.beside, frames);
            let rate = speed * playback.rate / f64::from(*every);
            let mut writer = match self.film.take() {
                Some(film) => film.writer,
                None => GifWriter::create(path, frame.width, frame.height, rate)?,
            };
            writer.push(&frame)?;
            self.film = Some(Film { writer, frames: frames + 1, last });
        }
        if sheet.is_some() && sheet::shows(actions, self.sheet_end) {
            self.tiles.push(playback.tile(env, step, *view, width, height));
        }
        if let Some(path) = png.as_ref().filter(|_| step.terminated || step.truncated || actions == last) {
            write_png(&picture(), path)?;
        }
        Ok(())
    }

    pub fn finish(self, playback: &Playback) -> Result<()> {
        if let Some(mut film) = self.film {
            for frame in film.frames..self.beside.len() {
                film.writer.push(&pair(&film.last, &self.beside, frame))?;
            }
            film.writer.finish()?;
        }
        if let Some((path, sheet)) = self.arguments.sheet.as_ref().zip(sheet::titled(&self.tiles, playback)) {
            write_png(&sheet, path)?;
        }
        Ok(())
    }
}

/// A frame with the second episode's picture beside it, if there is one. After its end the second episode keeps its last picture.
fn pair(here: &Image, beside: &[Image], frame: usize) -> Image {
    let there = beside.get(frame).or(beside.last());
    let both: Vec<Image> = iter::once(here).chain(there).cloned().collect();
    sheet::compose(&both).expect("at least one")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_picture_of_an_episode_stays_while_the_other_goes_on() {
        let grey = |grey| Image { width: 2, height: 1, rgb: vec![grey; 6] };
        assert_eq!(pair(&grey(7), &[], 3), grey(7));
        for (frame, right) in [(0, 1), (1, 2), (5, 2)] {
            let both = pair(&grey(7), &[grey(1), grey(2)], frame);
            assert_eq!((both.rgb[0], both.rgb[both.rgb.len() - 1]), (7, right));
        }
    }
}
