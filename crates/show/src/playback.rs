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
    /// Name of the action space.
    pub space: String,
    /// Who plays.
    pub who: String,
    /// What happened, in a sentence or two.
    pub story: String,
    /// Return and energy.
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
        let (space, who, limit) = (config.space.name.clone(), who.into(), config.force_penalty.limit);
        let mut playback = Playback { task, title, space, who, rate, ..Playback::default() };
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
        playback.story = story(env.task().achievement(), &outcome, playback.traces.time(), limit);
        let (total, energy) = (playback.total, outcome.energy_per_action_j);
        playback.detail = format!("return {total:.1} in {} actions, {energy:.2} J per action", outcome.length);
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

/// What happened: when and with which part of the arm the task was fulfilled, what that cost, whether it lasted, and what
/// went wrong. `limit` is the force from which the penalty counts (N), `time` how long it all took (s).
fn story(achievement: &str, outcome: &Outcome, time: f64, limit: f64) -> String {
    let mut text = match (outcome.time_to_success_s, outcome.energy_to_success_j, outcome.max_force_to_success_n) {
        (Some(first), Some(energy), Some(force)) => {
            let with = match outcome.hand_share_to_success {
                None => "",
                Some(share) if share > 0.9 => " with the hand",
                Some(share) if share < 0.1 => " with the forearm",
                Some(_) => " with hand and forearm",
            };
            let lasts = if outcome.success { "and it stays so" } else { "but not at the end" };
            let first_letter = achievement[..1].to_uppercase();
            let cost = format!("for {energy:.0} J and with at most {force:.0} N");
            format!("{first_letter}{} at {first:.2} s{with}, {cost}, {lasts}.", &achievement[1..])
        }
        _ => format!("Never {achievement} in {time:.1} s."),
    };
    if outcome.penalised_steps > 0 {
        text += &format!(" {} actions pressed with more than {limit:.0} N.", outcome.penalised_steps);
    }
    if outcome.diverged {
        text += " The simulation diverged.";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_story_says_when_how_and_what_went_wrong() {
        let opened = Outcome {
            time_to_success_s: Some(1.1),
            energy_to_success_j: Some(170.2),
            max_force_to_success_n: Some(180.4),
            hand_share_to_success: Some(0.02),
            success: true,
            penalised_steps: 7,
            ..Outcome::default()
        };
        assert_eq!(
            story("opens the door", &opened, 25.0, 60.0),
            "Opens the door at 1.10 s with the forearm, for 170 J and with at most 180 N, and it stays so. \
             7 actions pressed with more than 60 N."
        );
        let diverged = Outcome { diverged: true, ..Outcome::default() };
        assert_eq!(
            story("lifts the cube", &diverged, 2.5, 60.0),
            "Never lifts the cube in 2.5 s. The simulation diverged."
        );
    }
}
