//! Shows an episode: an interactive page, PNG, GIF, and forces, stiffness and torques over time as curves and numbers.

mod pictures;

use std::iter;
use std::path::PathBuf;
use std::process::ExitCode;

use self::pictures::Pictures;
use crate::run::seeds::{episode_seed, evaluation_seed};
use crate::run::source::{Player, SourceArgs};
use crate::run::which::Which;
use anyhow::Result;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{ArgGroup, Parser};
use output::file;
use output::program::{self, bad};
use show::plot;
use show::{Playback, View, page, sheet};
use tasks::{Env, EnvConfig, Step};

/// Draw an episode of a trained policy, a scripted expert or random actions.
///
/// Pictures show the simulated collision shapes; they need neither GPU nor display. Files that exist
/// are replaced.
#[derive(Parser)]
#[command(name = "replay", version = output::VERSION, after_help = "Example: replay --expert --task door --space aforce --html door.html")]
#[command(group = ArgGroup::new("pictures").multiple(true))]
pub struct Arguments {
    #[command(flatten)]
    source: SourceArgs,
    /// Which of the evaluation episodes: its start. What is drawn at random on the way (--random, --sample) is not what `evaluate` drew
    #[arg(long, default_value_t = 0)]
    episode: u32,
    /// The start with this number in the column episode_seed of a table, in place of one of the evaluation's
    #[arg(long, value_name = "SEED", value_parser = episode_seed, conflicts_with = "episode")]
    episode_seed: Option<u64>,
    /// The episode as a page for a browser: turn it, play it, scrub it, with all curves
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
    /// A second episode from the same reset, on the right of page and animation: of another run, or of the
    /// same script in another action space
    #[arg(long, value_name = "DIR|FILE.zip|SPACE")]
    beside: Option<String>,
    /// A paragraph above the page's scenes, after the one that says who plays (repeatable)
    #[arg(long, value_name = "TEXT", requires = "html")]
    note: Vec<String>,
    /// Last picture of the episode
    #[arg(long, value_name = "FILE.png", group = "pictures")]
    png: Option<PathBuf>,
    /// Twelve moments of the episode in one picture, the last two seconds after the task is done
    #[arg(long, value_name = "FILE.png", group = "pictures")]
    sheet: Option<PathBuf>,
    /// The episode as an animation
    #[arg(long, value_name = "FILE.gif", group = "pictures")]
    gif: Option<PathBuf>,
    /// Forces, stiffness, torques over time: FILE.svg and FILE.png
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// The same curves as numbers, with observation and action: a row per action
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// Where PNG, sheet and GIF look from
    #[arg(long, default_value = "task", requires = "pictures", value_parser = view_parser())]
    view: View,
    /// Actions from the start that are shown (default: the whole episode)
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    actions: Option<u32>,
    /// Actions between pictures of the animation
    #[arg(long, default_value_t = 2, requires = "gif", value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// How many times faster than real time the animation runs
    #[arg(long, value_name = "TIMES", default_value_t = 1.0, requires = "gif", value_parser = speed)]
    speed: f64,
    /// Width of PNG and GIF, and of each of the sheet's moments; the height is three quarters of it
    #[arg(long, default_value_t = 480, requires = "pictures", value_parser = clap::value_parser!(u16).range(16..=8192))]
    width: u16,
}

/// The views by name.
fn view_parser() -> impl TypedValueParser<Value = View> {
    let values = View::ALL.map(View::option).map(|(name, help)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(values)
        .map(|given| View::ALL.into_iter().find(|view| view.option().0 == given).expect("one of the possible values"))
}

/// A number above zero.
fn speed(text: &str) -> Result<f64, String> {
    let times = text.parse().ok().filter(|times: &f64| times.is_finite() && *times > 0.0);
    times.ok_or_else(|| "not a number above 0".into())
}

/// Runs the program and returns its exit code.
///
/// # Errors
/// If a setting is wrong, a run cannot be read, or a file not be written.
pub fn run(arguments: &Arguments) -> Result<ExitCode> {
    let written = arguments.files()?;
    let other = arguments.second_source()?;
    let mut pictures = Pictures::new(arguments);
    let beside = other.map(|other| {
        play(arguments, &other, |env, _, playback| {
            pictures.add_beside(env, playback);
            Ok(())
        })
    });
    let beside = beside.transpose()?.map(|(playback, _)| playback);
    if arguments.sheet.is_some() {
        // The sheet ends soon after the task is done. When that is, is known only after the episode was played once.
        pictures.sheet_end = sheet::last_action(&play(arguments, &arguments.source, |_, _, _| Ok(()))?.0);
    }
    let (playback, checkpoint) =
        play(arguments, &arguments.source, |env, step, playback| pictures.add(env, step, playback))?;
    pictures.finish(&playback)?;
    if let Some(stem) = arguments.plot_stem() {
        plot::write_with_png(&playback.title, &playback.traces.panels(), &stem)?;
    }
    if let Some(path) = &arguments.csv {
        playback.write_csv(path)?;
    }
    let episodes: Vec<Playback> = iter::once(playback).chain(beside).collect();
    if let Some(path) = &arguments.html {
        let notes: Vec<String> =
            iter::once(played(&arguments.source, checkpoint)).chain(arguments.note.clone()).collect();
        page::write(path, &episodes, &notes)?;
    }
    program::written(&written);
    episodes.iter().for_each(tell);
    Ok(ExitCode::SUCCESS)
}

impl Arguments {
    /// The files to be written, in order. Fails if one of them cannot be written.
    fn files(&self) -> Result<Vec<PathBuf>> {
        let Arguments { html, png, sheet, gif, plot, csv, .. } = self;
        if [html, png, sheet, gif, plot, csv].iter().all(|file| file.is_none()) {
            return Err(bad(
                "nothing to show: name at least one of --html, --png, --sheet, --gif, --plot, --csv".into()
            ));
        }
        for (flag, path, ending) in [
            ("html", html, "html"),
            ("png", png, "png"),
            ("sheet", sheet, "png"),
            ("gif", gif, "gif"),
            ("csv", csv, "csv"),
        ] {
            if let Some(path) = path.as_ref().filter(|path| path.extension().is_none_or(|given| given != ending)) {
                return Err(bad(format!("--{flag} {}: the file's name must end with .{ending}", path.display())));
            }
        }
        let plots = self.plot_stem().into_iter().flat_map(|stem| plot::files(&stem));
        let mut files: Vec<PathBuf> =
            [html, png, sheet, gif, csv].into_iter().flatten().cloned().chain(plots).collect();
        files.iter().try_for_each(|path| file::prepare(path))?;
        files.sort();
        let mut places = files.iter().map(|path| file::place(path)).collect::<Result<Vec<_>>>()?;
        places.sort();
        match places.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(twice) => Err(bad(format!("{}: two of the options would write it", twice[0].display()))),
            None => Ok(files),
        }
    }

    /// The plot's path without the ending.
    fn plot_stem(&self) -> Option<PathBuf> {
        self.plot.as_deref().map(plot::without_picture_extension)
    }

    /// Who plays the second episode, if there is one.
    fn second_source(&self) -> Result<Option<SourceArgs>> {
        let Some(what) = &self.beside else { return Ok(None) };
        if self.html.is_none() && self.gif.is_none() {
            return Err(bad(
                "--beside goes with --html or --gif: neither the pictures nor the curves show a second episode".into(),
            ));
        }
        let other = self.source.beside(what)?;
        match sets_apart(&self.source.open()?.config.env, &other.open()?.config.env) {
            Some(what) => {
                Err(bad(format!("--beside plays {what}: the two would not start alike, or not keep in time")))
            }
            None => Ok(Some(other)),
        }
    }
}

/// Why a second episode cannot be shown beside the first: task, arm, start and the time of an action have to be the same.
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
    } else if here.options != there.options {
        Some("other options of the task (env.options)".into())
    } else if here.disturbance != there.disturbance {
        Some("another disturbance (env.disturbance)".into())
    } else {
        None
    }
}

/// Prints who played and what happened.
fn tell(playback: &Playback) {
    let Playback { title, who, detail, story, .. } = playback;
    program::result(format_args!("{title}, {who}: {detail}. {story}"));
}

/// Who chooses the actions, in a sentence.
fn played(source: &SourceArgs, checkpoint: Option<Which>) -> String {
    let which = checkpoint.map(|which| match which {
        Which::Best => "kept from the best evaluation of its training",
        Which::Last => "as its training left it",
    });
    match which {
        Some(which) if source.sample => {
            format!("Played: actions sampled from the policy {which}, with the noise that it explores with.")
        }
        Some(which) => format!(
            "Played: mean actions of the policy {which}, without the noise that it explores with while it learns."
        ),
        None if source.expert => "Played: the task's script, which learned nothing.".into(),
        None => "Played: uniformly random actions.".into(),
    }
}

/// Plays the episode of `source`. Also returns which checkpoint of a run played.
fn play(
    arguments: &Arguments,
    source: &SourceArgs,
    on_step: impl FnMut(&Env, &Step, &Playback) -> Result<()>,
) -> Result<(Playback, Option<Which>)> {
    let Player { mut env, mut policy, checkpoint, .. } = source.open()?;
    let seed = arguments.episode_seed.unwrap_or_else(|| evaluation_seed(arguments.episode));
    let actions = arguments.actions.unwrap_or(env.config().horizon);
    let playback = Playback::play(&mut env, |env| policy.act(env), seed, actions, &source.describe(), on_step)?;
    Ok((playback, checkpoint))
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
            (with(|env| env.task = tasks::TaskName::WIPE), "wipe, not lift"),
            (with(|env| env.controller.policy_hz = 10), "10 actions a second, not 20"),
            (with(|env| env.initial_noise = 0.1), "0.1, not 0.02"),
            (with(|env| env.robot = physics::robots::RobotName::Identified.into()), "env.robot"),
        ] {
            assert!(apart.as_ref().is_some_and(|apart| apart.contains(words)), "{apart:?}");
        }
    }
}
