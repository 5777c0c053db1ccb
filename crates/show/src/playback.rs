//! An episode that is played to be shown.

use std::path::Path;

use aforce::{ActionSpace, Stiffness};
use anyhow::Result;
use output::file;
use physics::camera::Image;
use tasks::{Env, Episode, Outcome, Step};

use crate::caption::{caption, heading, with_strip};
use crate::inputs::Inputs;
use crate::recording::{Recording, contact_force, tool};
use crate::traces::Traces;
use crate::view::View;
use crate::{arrow, palette};

/// An episode: what is seen and what is plotted.
#[derive(Debug, Clone, Default)]
pub struct Playback {
    /// Task and action space.
    pub title: String,
    /// Name of the action space.
    pub space: String,
    /// The action space's name in texts.
    pub called: String,
    /// Where its stiffness comes from, in words.
    pub stiffness: &'static str,
    /// Name of the task.
    pub task: String,
    /// What plays: a policy or the script.
    pub who: String,
    /// What happened, in a sentence or two.
    pub story: String,
    /// Return and energy.
    pub detail: String,
    /// Actions per second.
    pub rate: f64,
    /// Sum of the rewards so far.
    pub total: f64,
    /// Whether the episode has come to its end.
    pub over: bool,
    /// Shapes and poses.
    pub recording: Recording,
    /// Curves.
    pub traces: Traces,
    /// Observations and actions.
    pub inputs: Inputs,
    /// What every action led to.
    pub episode: Episode,
}

impl Playback {
    /// A playback of an episode of `env` that begins.
    pub fn begin(env: &Env) -> Playback {
        let config = env.config();
        let title = format!("{} {}", env.task().name(), config.space);
        let rate = f64::from(config.controller.policy_hz);
        Playback {
            title,
            space: config.space.name.clone(),
            called: called(&config.space),
            stiffness: where_stiffness_comes_from(&config.space),
            task: env.task().name().into(),
            rate,
            ..Playback::default()
        }
    }

    /// Adds the outcome of an `action`; `observation` is the one before it.
    pub fn add(&mut self, env: &Env, observation: &[f32], action: &[f64], step: &Step) {
        self.total += step.reward;
        self.over = step.terminated || step.truncated;
        self.recording.add(env, step);
        self.traces.add(env, step);
        self.inputs.add(env, observation, action);
        self.episode.add(*step);
    }

    /// Ends the playback of an episode of `env`; `who` names what played.
    pub fn end(&mut self, env: &Env, who: &str) {
        let outcome = self.episode.outcome();
        let limit = env.config().force_penalty.limit;
        self.who = who.into();
        let part = if self.over { "the end" } else { "the end of this part" };
        self.story = story(env.task().achievement(), &outcome, self.traces.time(), limit, part);
        let [energy, actions] = ["energy_per_action_j", "length"].map(|name| outcome.number(name).unwrap_or(f64::NAN));
        let (total, what) = (self.total, if self.over { "the whole episode" } else { "a part of the episode" });
        self.detail = format!("{what}: return {total:.1} in {actions} actions, {energy:.2} J per action");
    }

    /// Plays the first `actions` of an episode from `seed`. `act` chooses them in [-1, 1]^n; `who` names what plays.
    /// `on_step` is called after every action, with the playback so far.
    ///
    /// # Errors
    /// The first error of `on_step`.
    pub fn play(
        env: &mut Env,
        mut act: impl FnMut(&Env) -> Vec<f64>,
        seed: u64,
        actions: u32,
        who: &str,
        mut on_step: impl FnMut(&Env, &Step, &Playback) -> Result<()>,
    ) -> Result<Playback> {
        let mut playback = Playback::begin(env);
        env.reset(Some(seed));
        for _ in 0..actions {
            let (observation, action) = (env.observation().to_vec(), act(env));
            let step = env.step(&action);
            playback.add(env, &observation, &action, &step);
            on_step(env, &step, &playback)?;
            if playback.over {
                break;
            }
        }
        playback.end(env, who);
        Ok(playback)
    }

    /// The episode as a CSV file, a row per action: every curve, what was observed before the action, and the action.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        let mut table = csv::Writer::from_writer(vec![]);
        table.write_record(self.traces.names().iter().chain(self.inputs.names()))?;
        for (curves, inputs) in self.traces.rows().zip(self.inputs.rows()) {
            table.write_record(curves.iter().map(f64::to_string).chain(inputs.iter().cloned()))?;
        }
        file::replace(path, &table.into_inner()?)
    }

    /// A picture of the present moment: the scene, the contact force as an arrow, a caption.
    pub fn picture(&self, env: &Env, step: &Step, view: View, width: usize, height: usize) -> Image {
        let mut image = scene(env, view, width, height);
        // Padded to a constant length, because a shorter caption would have larger letters.
        let done = if step.success { "done" } else { "" };
        let (time, total) = (self.traces.time(), self.total);
        caption(&mut image, &format!("{}  {time:5.2} s  return {total:5.1} {done:4}", self.title));
        image
    }

    /// A picture of the present moment for a contact sheet: the scene, the contact force as an arrow, below it the time.
    pub fn tile(&self, env: &Env, step: &Step, view: View, width: usize, height: usize) -> Image {
        let done = if step.success { ", task done" } else { "" };
        with_strip(&scene(env, view, width, height), &format!("{:.2} s{done}", self.traces.time()), 36, true)
    }

    /// A picture to stand beside that of another action space: large letters say the space, the time, how many times faster than
    /// real time the film runs, and whether the task has been fulfilled; below them a line in the space's colour.
    pub fn labelled_picture(&self, env: &Env, view: View, width: usize, height: usize, speed: f64) -> Image {
        let mut image = scene(env, view, width, height);
        let done = if self.episode.outcome().number("time_to_success_s").is_some() { "done" } else { "" };
        let fast = if speed == 1.0 { String::new() } else { format!("{speed}x ") };
        // Without ` + force`, which both pictures' spaces have.
        let name = self.called.split(" + ").next().unwrap_or_default();
        heading(
            &mut image,
            &format!("{name} {fast}{:4.1} s {done:4}", self.traces.time()),
            palette::of_space(&self.space),
        );
        image
    }
}

/// What the camera sees, with the contact force as an arrow.
fn scene(env: &Env, view: View, width: usize, height: usize) -> Image {
    let camera = view.of(&env.task().camera());
    let mut image = camera.render(env.simulation(), &env.task().decals(), width, height);
    arrow::draw_force(&mut image, &camera, &tool(env), &contact_force(env.simulation()));
    image
}

/// The name of a space in texts: "AFORCE", "variable", "AFORCE + force".
fn called(space: &ActionSpace) -> String {
    let name = space.name.replace("aforce", "AFORCE");
    name.strip_suffix("-force").filter(|_| space.force).map_or(name.clone(), |name| format!("{name} + force"))
}

/// What decides on the stiffness, in words.
fn where_stiffness_comes_from(space: &ActionSpace) -> &'static str {
    match space.stiffness {
        Stiffness::Adaptive(_) if space.commanded_psi.is_some() => "the policy sets the law that adapts the stiffness",
        Stiffness::Adaptive(_) => "the law adapts the stiffness",
        Stiffness::Commanded(_) => "the policy commands the stiffness",
        Stiffness::Fixed(_) => "the stiffness is constant",
    }
}

/// What happened: when and with which part of the arm the task was fulfilled, what that cost, whether it lasted, and what
/// went wrong. `limit` is the force from which the penalty counts (N), `time` how long it all took (s).
fn story(achievement: &str, outcome: &Outcome, time: f64, limit: f64, end: &str) -> String {
    let to_success = ["time_to_success_s", "energy_to_success_j", "max_force_to_success_n"];
    let mut text = match to_success.map(|name| outcome.number(name)) {
        [Some(first), Some(energy), Some(force)] => {
            let with = match outcome.number("hand_share_to_success") {
                None => "",
                Some(share) if share > 0.9 => " with the hand",
                Some(share) if share < 0.1 => " with the forearm",
                Some(_) => " with hand and forearm",
            };
            let lasts = if outcome.flag("success") { "it is still done" } else { "it is not done" };
            let mut rest = achievement.chars();
            let first_letter = rest.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
            let cost = format!("for {energy:.0} J and with at most {force:.0} N");
            format!("{first_letter}{} at {first:.2} s{with}, {cost}; {lasts} at {end}.", rest.as_str())
        }
        _ => format!("Never {achievement} in {time:.1} s."),
    };
    if let Some(pressed) = outcome.number("penalised_steps").filter(|&steps| steps > 0.0) {
        let actions = if pressed == 1.0 { "action" } else { "actions" };
        text += &format!(" {pressed} {actions} pressed with more than {limit:.0} N.");
    }
    if outcome.flag("diverged") {
        text += " The simulation diverged.";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use tasks::EnvConfig;
    use tasks::columns::Cell;

    #[test]
    fn a_story_says_when_how_and_what_went_wrong() {
        let opened = Outcome::default().with(&[
            ("time_to_success_s", Cell::Real(1.1)),
            ("energy_to_success_j", Cell::Real(170.2)),
            ("max_force_to_success_n", Cell::Real(180.4)),
            ("hand_share_to_success", Cell::Real(0.02)),
            ("success", Cell::Flag(true)),
            ("penalised_steps", Cell::Count(7)),
        ]);
        assert_eq!(
            story("opens the door", &opened, 25.0, 60.0, "the end"),
            "Opens the door at 1.10 s with the forearm, for 170 J and with at most 180 N; it is still done at the end. \
             7 actions pressed with more than 60 N."
        );
        let pressed = Outcome::default().with(&[("penalised_steps", Cell::Count(1))]);
        let words = "Never lifts the cube in 2.5 s. 1 action pressed with more than 60 N.";
        assert_eq!(story("lifts the cube", &pressed, 2.5, 60.0, "the end"), words);
        let part = story("opens the door", &opened, 2.0, 60.0, "the end of this part");
        assert!(part.contains("it is still done at the end of this part."), "{part}");
        let diverged = Outcome::default().with(&[("diverged", Cell::Flag(true))]);
        assert_eq!(
            story("lifts the cube", &diverged, 2.5, 60.0, "the end"),
            "Never lifts the cube in 2.5 s. The simulation diverged."
        );
    }

    #[test]
    fn spaces_are_called_by_who_decides_on_the_stiffness() {
        for (space, name, words) in [
            ("aforce", "AFORCE", "the law adapts the stiffness"),
            ("aforce-force", "AFORCE + force", "the law adapts the stiffness"),
            ("aforce-psi", "AFORCE-psi", "the policy sets the law that adapts the stiffness"),
            ("variable", "variable", "the policy commands the stiffness"),
            ("osc", "osc", "the stiffness is constant"),
        ] {
            let space: ActionSpace = space.parse().unwrap();
            assert_eq!((called(&space).as_str(), where_stiffness_comes_from(&space)), (name, words));
        }
    }

    /// A strip of letters, and below it a line in the space's colour.
    #[test]
    fn a_picture_beside_another_says_whose_it_is() {
        let mut env = Env::new(EnvConfig::default(), 0).unwrap();
        let mut image = None;
        let played = Playback::play(&mut env, Env::expert_action, 3, 1, "script", |env, _, playback| {
            image = Some(playback.labelled_picture(env, View::Task, 240, 180, 2.0));
            Ok(())
        });
        let (image, blue) = (image.unwrap(), [0, 114, 178]);
        assert_eq!(palette::of_space(&played.unwrap().space), Some("#0072b2"));
        let rows: Vec<_> = image.rgb.chunks_exact(3 * 240).map(|row| row.as_chunks::<3>().0).collect();
        let line = rows.iter().position(|row| row.iter().all(|pixel| *pixel == blue)).unwrap();
        assert!(rows[..line].iter().all(|row| row.iter().all(|pixel| pixel.iter().all(|v| *v == 250 || *v == 30))));
        assert!(rows[..line].iter().flat_map(|row| *row).any(|pixel| *pixel == [30; 3]), "letters");
    }

    /// The actions in the table lead to the observations in it, to the last bit.
    #[test]
    fn a_table_is_enough_to_play_the_episode_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("episode.csv");
        let mut env = Env::new(EnvConfig::default(), 0).unwrap();
        let played = Playback::play(&mut env, Env::expert_action, 3, 10, "script", |_, _, _| Ok(())).unwrap();
        played.write_csv(&path).unwrap();

        let mut table = csv::Reader::from_path(&path).unwrap();
        let names = table.headers().unwrap().clone();
        let columns = |what: &str| {
            let columns = names.iter().enumerate().filter(|(_, name)| name.starts_with(what));
            columns.map(|(at, _)| at).collect::<Vec<_>>()
        };
        let (observations, actions) = (columns("Observation, "), columns("Action, "));
        assert_eq!((observations.len(), actions.len()), (env.observation().len(), env.action_dim()));
        assert_eq!(&names[actions[0]], "Action, delta_x (-1 to 1)");
        env.reset(Some(3));
        let mut total = 0.0;
        for row in table.records() {
            let row = row.unwrap();
            let observed: Vec<f32> = observations.iter().map(|&at| row[at].parse().unwrap()).collect();
            let action: Vec<f64> = actions.iter().map(|&at| row[at].parse().unwrap()).collect();
            assert_eq!(observed, env.observation());
            total += env.step(&action).reward;
        }
        assert_eq!((total, played.traces.actions()), (played.total, 10));
    }
}
