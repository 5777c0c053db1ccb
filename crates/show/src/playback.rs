//! An episode that was played to be shown.

use std::ops::ControlFlow;

use anyhow::Result;
use output::caption;
use physics::camera::Image;
use tasks::{Env, Outcome, Step, play};

use crate::arrow;
use crate::recording::{Recording, contact_force, tool};
use crate::traces::Traces;
use crate::view::View;

/// An episode: what is seen and what is plotted.
#[derive(Debug, Clone, Default)]
pub struct Playback {
    /// Name of the task.
    pub task: &'static str,
    /// Task and action space.
    pub title: String,
    /// Who plays, and how it went.
    pub detail: String,
    /// Actions per second.
    pub rate: f64,
    /// Sum of the rewards so far.
    pub total: f64,
    /// Shapes and poses.
    pub recording: Recording,
    /// Curves.
    pub traces: Traces,
}

impl Playback {
    /// Plays the first `actions` of an episode from `seed`, `act` choosing them in [-1, 1]^n; `who` says who that is.
    /// `on_step` sees the playback grow after every action.
    ///
    /// # Errors
    /// The first error of `on_step`.
    pub fn play(
        env: &mut Env,
        act: impl FnMut(&Env) -> Vec<f64>,
        seed: u64,
        actions: u32,
        who: &str,
        mut on_step: impl FnMut(&Env, &Step, &Playback) -> Result<()>,
    ) -> Result<Playback> {
        let config = env.config();
        let task = config.task.as_str();
        let title = format!("{task} {}", config.space);
        let rate = f64::from(config.controller.policy_hz);
        let mut playback = Playback { task, title, rate, ..Playback::default() };
        let mut seen = Ok(());
        let outcome = play(env, act, seed, |env, step| {
            playback.total += step.reward;
            playback.recording.add(env, step);
            playback.traces.add(env, step);
            seen = on_step(env, step, &playback);
            let enough = seen.is_err() || playback.traces.actions() == actions;
            if enough { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .outcome();
        seen?;
        playback.detail =
            format!("{who}: return {:.1} in {} actions, {}", playback.total, outcome.length, in_words(&outcome));
        Ok(playback)
    }

    /// A picture of the present moment: the scene, the contact force as an arrow, a caption.
    pub fn picture(&self, env: &Env, step: &Step, view: View, width: usize, height: usize) -> Image {
        let camera = view.of(&env.task().camera());
        let mut image = camera.render(env.simulation(), &env.task().decals(), width, height);
        arrow::draw_force(&mut image, &camera, &tool(env), &contact_force(env.simulation()));
        // Of constant length: the shorter a caption, the larger its letters.
        let done = if step.success { "done" } else { "" };
        let (time, total) = (self.traces.time(), self.total);
        caption(&mut image, &format!("{}  {time:5.2} s  return {total:5.1} {done:4}", self.title));
        image
    }
}

/// What the episode cost: until the task was first fulfilled, and as a whole.
fn in_words(outcome: &Outcome) -> String {
    let whole = format!("{:.2} J per action", outcome.energy_per_action_j);
    let end = if outcome.success { "fulfilled at the end" } else { "not fulfilled at the end" };
    match (outcome.time_to_success_s, outcome.energy_to_success_j, outcome.max_force_to_success_n) {
        (Some(time), Some(energy), Some(force)) => {
            format!("{whole}; first fulfilled after {time:.2} s, {energy:.0} J and at most {force:.0} N; {end}")
        }
        _ => format!("{whole}; never fulfilled"),
    }
}
