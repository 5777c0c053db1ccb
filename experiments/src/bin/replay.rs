//! Shows an episode: PNG, GIF, and the forces, stiffness and torques over time.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, ensure};
use clap::Parser;
use experiments::cli;
use experiments::rollout::episode;
use experiments::seeds::evaluation_seed;
use experiments::source::SourceArgs;
use experiments::traces::Traces;
use output::picture::{GifWriter, caption, write_png};
use output::plot;
use physics::camera::Image;
use tasks::{Env, Step};

/// Draw an episode of a trained policy, a scripted expert or random actions.
///
/// Pictures show the simulated collision shapes; they need neither GPU nor display.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    source: SourceArgs,
    /// Which of the evaluation episodes
    #[arg(long, default_value_t = 0)]
    episode: u32,
    /// Last picture of the episode
    #[arg(long, value_name = "FILE.png")]
    png: Option<PathBuf>,
    /// The episode as an animation
    #[arg(long, value_name = "FILE.gif")]
    gif: Option<PathBuf>,
    /// Forces, stiffness, torques over time: FILE.svg and FILE.png
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Actions from the start that are shown
    #[arg(long, default_value_t = 200)]
    actions: u32,
    /// Actions between pictures of the animation
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Width of the pictures; the height is three quarters of it
    #[arg(long, default_value_t = 480, value_parser = clap::value_parser!(u16).range(16..))]
    width: u16,
}

fn main() -> ExitCode {
    cli::run(|| run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    ensure!(
        arguments.png.is_some() || arguments.gif.is_some() || arguments.plot.is_some(),
        "nothing to draw: name at least one of --png, --gif, --plot"
    );
    let (mut config, _, mut policy) = arguments.source.open()?;
    config.env.horizon = config.env.horizon.min(arguments.actions);
    let mut env = Env::new(config.env.clone(), 0)?;
    let (width, height) = (usize::from(arguments.width), usize::from(arguments.width) * 3 / 4);
    let frames_per_second = f64::from(config.env.controller.policy_hz) / f64::from(arguments.every);

    let mut gif =
        arguments.gif.as_ref().map(|path| GifWriter::create(path, width, height, frames_per_second)).transpose()?;
    let mut traces = Traces::default();
    let mut total = 0.0;
    let mut failed = Ok(());
    episode(&mut env, &mut policy, evaluation_seed(arguments.episode), |env, step| {
        total += step.reward;
        traces.add(env, step);
        if let Some(gif) = gif.as_mut().filter(|_| traces.actions().is_multiple_of(arguments.every) && failed.is_ok()) {
            failed = gif.push(&picture(env, step, &traces, total, width, height));
        }
        if let Some(path) = arguments.png.as_ref().filter(|_| step.terminated || step.truncated) {
            failed = write_png(&picture(env, step, &traces, total, width, height), path);
        }
    });
    failed?;
    if let Some(gif) = gif {
        gif.finish()?;
    }
    if let Some(path) = &arguments.plot {
        plot::write(&traces.panels(), &path.with_extension(""))?;
    }
    println!("return {total:.1} in {} actions", traces.actions());
    Ok(ExitCode::SUCCESS)
}

fn picture(env: &Env, step: &Step, traces: &Traces, total: f64, width: usize, height: usize) -> Image {
    let mut image = env.task().camera().render(env.simulation(), &env.task().decals(), width, height);
    let (task, space) = (env.config().task.as_str(), env.config().space);
    let done = if step.success { "  done" } else { "" };
    caption(&mut image, &format!("{task}  {space}  {:5.2} s  return {total:5.1}{done}", traces.time()));
    image
}
