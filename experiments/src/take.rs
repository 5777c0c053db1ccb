//! An episode that was played to be shown.

use std::ops::ControlFlow;

use anyhow::Result;
use output::caption;
use physics::camera::Image;
use tasks::{Env, Step};

use crate::arrow;
use crate::recording::{Recording, contact_force, tool};
use crate::rollout::{Policy, episode};
use crate::traces::Traces;
use crate::view::View;

/// An episode: what is seen and what is plotted.
#[derive(Debug, Clone, Default)]
pub struct Take {
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

impl Take {
    /// Plays the first `actions` of an episode from `seed`; `who` says whose. `watch` sees it grow
    /// after every action.
    ///
    /// # Errors
    /// The first error of `watch`.
    pub fn play(
        env: &mut Env,
        policy: &mut Policy,
        seed: u64,
        actions: u32,
        who: &str,
        mut watch: impl FnMut(&Env, &Step, &Take) -> Result<()>,
    ) -> Result<Take> {
        let config = env.config();
        let task = config.task.as_str();
        let title = format!("{task} {}", config.space);
        let mut take = Take { task, title, rate: f64::from(config.controller.policy_hz), ..Take::default() };
        let mut watched = Ok(());
        let outcome = episode(env, policy, seed, |env, step| {
            take.total += step.reward;
            take.recording.add(env, step);
            take.traces.add(env, step);
            watched = watch(env, step, &take);
            let enough = watched.is_err() || take.traces.actions() == actions;
            if enough { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .outcome();
        watched?;
        let done = if outcome.success { ", fulfilled at the end" } else { "" };
        let energy = outcome.energy_per_action_j;
        take.detail = format!("{who}: return {:.1}, {energy:.2} J per action{done}", take.total);
        Ok(take)
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
