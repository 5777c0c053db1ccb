//! Shows an episode: an interactive page, PNG, GIF, and forces, stiffness and torques over time as curves and numbers.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use experiments::run::seeds::evaluation_seed;
use experiments::run::source::{Player, SourceArgs};
use output::file;
use output::picture::{GifWriter, write_png};
use output::plot;
use output::program::{self, bad};
use physics::camera::Image;
use show::{Playback, View, page, sheet};
use tasks::{Env, EnvConfig, Step};

/// Draw an episode of a trained policy, a scripted expert or random actions.
///
/// Pictures show the simulated collision shapes; they need neither GPU nor display. Files that exist
/// are replaced.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    source: SourceArgs,
    /// Which of the evaluation episodes: its start. What is drawn at random on the way (--random, --sample) is not what `evaluate` drew
    #[arg(long, default_value_t = 0)]
    episode: u32,
    /// The episode as a page for a browser: turn it, play it, scrub it, with all curves
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
    /// A second episode from the same reset, on the right of the page: of another run, or of the same
    /// script in another action space
    #[arg(long, value_name = "DIR|SPACE", requires = "html")]
    beside: Option<String>,
    /// Last picture of the episode
    #[arg(long, value_name = "FILE.png")]
    png: Option<PathBuf>,
    /// Twelve moments of the episode in one picture
    #[arg(long, value_name = "FILE.png")]
    sheet: Option<PathBuf>,
    /// The episode as an animation
    #[arg(long, value_name = "FILE.gif")]
    gif: Option<PathBuf>,
    /// Forces, stiffness, torques over time: FILE.svg and FILE.png
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// The same curves as numbers, with observation and action: a row per action
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// Where PNG and GIF look from
    #[arg(long, default_value = "task", value_parser = view_parser())]
    view: View,
    /// Actions from the start that are shown (default: the whole episode)
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    actions: Option<u32>,
    /// Actions between pictures of the animation
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Width of the pictures; the height is three quarters of it
    #[arg(long, default_value_t = 480, value_parser = clap::value_parser!(u16).range(16..=8192))]
    width: u16,
}

/// The views by name.
const VIEWS: [(&str, View, &str); 4] = [
    ("task", View::Task, "The task's own"),
    ("front", View::Front, "From in front of the robot"),
    ("side", View::Side, "From the robot's right"),
    ("top", View::Top, "From above, the robot at the top"),
];

fn view_parser() -> impl TypedValueParser<Value = View> {
    PossibleValuesParser::new(VIEWS.map(|(name, _, help)| PossibleValue::new(name).help(help)))
        .map(|given| VIEWS.into_iter().find(|(name, ..)| *name == given).expect("one of the possible values").1)
}

fn main() -> ExitCode {
    program::run(|| run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    let Arguments { html, png, sheet, gif, plot, csv, .. } = arguments;
    if [html, png, sheet, gif, plot, csv].iter().all(|file| file.is_none()) {
        return Err(bad("nothing to show: name at least one of --html, --png, --sheet, --gif, --plot, --csv".into()));
    }
    for path in [html, png, sheet, gif, plot, csv].into_iter().flatten() {
        file::prepare(path)?;
    }
    let plot = plot.as_ref().map(|path| without_picture_extension(path));
    let plots = plot.iter().flat_map(|stem| plot::files(stem));
    let mut written: Vec<PathBuf> = [html, png, sheet, gif, csv].into_iter().flatten().cloned().chain(plots).collect();
    written.sort();
    let mut places = written.iter().map(|path| file::place(path)).collect::<Result<Vec<_>>>()?;
    places.sort();
    if let Some(twice) = places.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(bad(format!("{}: two of the options would write it", twice[0].display())));
    }
    let beside = arguments.beside.as_ref().map(|what| arguments.source.beside(what)).transpose()?;
    if let Some(other) = &beside {
        let (here, there) = (arguments.source.open()?.config.env, other.open()?.config.env);
        if let Some(what) = sets_apart(&here, &there) {
            return Err(bad(format!("--beside plays {what}: the two would not start alike, or not keep in time")));
        }
    }
    let mut pictures = Pictures { arguments, tiles: vec![], film: None };
    let playback = play(arguments, &arguments.source, |env, step, playback| pictures.add(env, step, playback))?;
    pictures.finish()?;
    if let Some(stem) = &plot {
        plot::write_with_png(&playback.title, &playback.traces.panels(), stem)?;
    }
    if let Some(path) = &arguments.csv {
        playback.write_csv(path)?;
    }
    tell(&playback);
    if let Some(path) = &arguments.html {
        let mut episodes = vec![playback];
        if let Some(other) = &beside {
            let other = play(arguments, other, |_, _, _| Ok(()))?;
            tell(&other);
            episodes.push(other);
        }
        page::write(path, &episodes)?;
    }
    program::written(&written);
    Ok(ExitCode::SUCCESS)
}

/// What keeps a second episode from being shown beside the first: task, arm and start are to be the same, and the time that an action
/// takes.
fn sets_apart(here: &EnvConfig, there: &EnvConfig) -> Option<String> {
    let (task, other_task) = (here.task.as_str(), there.task.as_str());
    let rates = [here, there].map(|env| env.controller.policy_hz);
    if task != other_task {
        Some(format!("{other_task}, not {task}"))
    } else if rates[0] != rates[1] {
        Some(format!("{} actions a second, not {}", rates[1], rates[0]))
    } else if here.robot != there.robot {
        Some("another arm (env.robot)".into())
    } else if here.initial_noise != there.initial_noise {
        Some(format!("env.initial_noise = {}, not {}", there.initial_noise, here.initial_noise))
    } else {
        None
    }
}

/// What happened.
fn tell(playback: &Playback) {
    let Playback { title, who, detail, story, .. } = playback;
    program::say(format_args!("{title}, {who}: {detail}. {story}"));
}

/// FILE.svg means FILE; of "seed_0.5" the dot belongs to the name.
fn without_picture_extension(path: &Path) -> PathBuf {
    let is_picture = path.extension().is_some_and(|extension| extension == "svg" || extension == "png");
    if is_picture { path.with_extension("") } else { path.into() }
}

/// Plays the episode of `source`.
fn play(
    arguments: &Arguments,
    source: &SourceArgs,
    on_step: impl FnMut(&Env, &Step, &Playback) -> Result<()>,
) -> Result<Playback> {
    let Player { mut env, mut policy, .. } = source.open()?;
    let seed = evaluation_seed(arguments.episode);
    let actions = arguments.actions.unwrap_or(env.config().horizon);
    Playback::play(&mut env, |env| policy.act(env), seed, actions, &source.describe(), on_step)
}

/// The ray-cast pictures that were asked for.
struct Pictures<'a> {
    arguments: &'a Arguments,
    tiles: Vec<Image>,
    film: Option<GifWriter>,
}

impl Pictures<'_> {
    /// Draws the present moment if anybody wants it.
    fn add(&mut self, env: &Env, step: &Step, playback: &Playback) -> Result<()> {
        let Arguments { png, sheet, gif, view, every, width, .. } = self.arguments;
        let (width, height) = (usize::from(*width), usize::from(*width) * 3 / 4);
        let picture = || playback.picture(env, step, *view, width, height);
        let (actions, last) =
            (playback.traces.actions(), self.arguments.actions.unwrap_or(u32::MAX).min(env.config().horizon));
        if let Some(path) = gif.as_ref().filter(|_| (actions - 1).is_multiple_of(*every)) {
            if self.film.is_none() {
                self.film = Some(GifWriter::create(path, width, height, playback.rate / f64::from(*every))?);
            }
            self.film.as_mut().expect("just started").push(&picture())?;
        }
        if sheet.is_some() && (sheet::shows(actions, last) || step.terminated || step.truncated) {
            self.tiles.push(picture());
        }
        if let Some(path) = png.as_ref().filter(|_| step.terminated || step.truncated || actions == last) {
            write_png(&picture(), path)?;
        }
        Ok(())
    }

    fn finish(self) -> Result<()> {
        if let Some(film) = self.film {
            film.finish()?;
        }
        if let Some((path, sheet)) = self.arguments.sheet.as_ref().zip(sheet::compose(&self.tiles)) {
            write_png(&sheet, path)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn episodes_that_start_alike_and_keep_in_time_are_shown_side_by_side() {
        let here = EnvConfig::default();
        let with = |change: fn(&mut EnvConfig)| {
            let mut there = here.clone();
            change(&mut there);
            sets_apart(&here, &there)
        };
        assert_eq!(with(|env| env.space = "osc".parse().unwrap()), None);
        for (apart, words) in [
            (with(|env| env.task = tasks::TaskName::Wipe), "wipe, not lift"),
            (with(|env| env.controller.policy_hz = 10), "10 actions a second, not 20"),
            (with(|env| env.initial_noise = 0.1), "0.1, not 0.02"),
            (with(|env| env.robot = physics::panda::ParameterSet::Identified), "env.robot"),
        ] {
            assert!(apart.as_ref().is_some_and(|apart| apart.contains(words)), "{apart:?}");
        }
    }
}
