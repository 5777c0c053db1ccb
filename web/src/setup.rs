//! What a person can choose: the settings of a live episode, as the page's address holds them.

use std::collections::BTreeMap;

use aforce::{ActionSpace, Gains, PsiParameter, Stiffness};
use serde::{Deserialize, Serialize};
use tasks::{Draw, EnvConfig, TaskName};

use crate::policy::Policy;

/// The settings of a live episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Setup {
    /// Name of the task.
    pub task: String,
    /// Name of a built-in action space.
    pub space: String,
    /// `script`, `hold` (no player: the goal stays), or the run of a kept policy, below `results/`.
    pub player: String,
    /// Seed of the episode.
    pub seed: u64,
    /// Factor on every coefficient of sliding friction.
    pub friction: f64,
    /// Mass at the tool point that the model does not know (kg).
    pub payload: f64,
    /// How much higher the table stands than is observed (m).
    pub table: f64,
    /// How late torques act (s).
    pub delay: f64,
    /// Numbers of the action space that differ from its own, by the names of [`knobs`].
    pub knobs: BTreeMap<String, f64>,
}

impl Default for Setup {
    fn default() -> Self {
        Setup {
            task: "lift".into(),
            space: "aforce".into(),
            player: "script".into(),
            seed: 3,
            friction: 1.0,
            payload: 0.0,
            table: 0.0,
            delay: 0.0,
            knobs: BTreeMap::new(),
        }
    }
}

/// A number of an action space that a slider moves: that of the translational axes. Those of the rotational axes keep their ratio to it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Knob {
    /// Name of the number in an address.
    pub name: &'static str,
    /// Meaning of the number.
    pub what: &'static str,
    /// Unit of the number.
    pub unit: String,
    /// The space's own value.
    pub own: f64,
    /// Ends of the slider.
    pub range: [f64; 2],
}

/// Ends of a slider, as factors of the space's own value.
const REACH: [f64; 2] = [0.2, 5.0];

/// Who plays.
pub enum Player {
    /// The task's script.
    Script,
    /// No player: the goal stays where it is.
    Hold,
    /// A kept policy.
    Policy(Box<Policy>),
}

/// The places of a space's knobs: name, meaning, and the numbers themselves. What the actions command is no knob: a slider would
/// move nothing.
fn places(space: &mut ActionSpace) -> Vec<(&'static str, &'static str, &mut Gains)> {
    let ActionSpace { stiffness, commanded_psi, .. } = space;
    let is_commanded = |parameter: PsiParameter| {
        commanded_psi.iter().flat_map(|psi| &psi.ranges).any(|range| range.parameter == parameter)
    };
    match stiffness {
        Stiffness::Fixed(stiffness) => vec![("stiffness", "stiffness", stiffness)],
        Stiffness::Commanded(range) => vec![("stiffness_max", "largest stiffness", &mut range.high)],
        Stiffness::Adaptive(psi) => [
            (PsiParameter::KMin, "k_min", "lowest stiffness", &mut psi.k_min),
            (PsiParameter::KMax, "k_max", "highest stiffness", &mut psi.k_max),
            // A commanded tolerance gamma/beta makes beta of gamma.
            (PsiParameter::Tolerance, "beta", "beta: growth of the stiffness per error", &mut psi.beta),
            (PsiParameter::Alpha, "alpha", "alpha: growth of the feed-forward per error", &mut psi.alpha),
        ]
        .into_iter()
        .filter(|(parameter, ..)| !is_commanded(*parameter))
        .map(|(_, name, what, gains)| (name, what, gains))
        .collect(),
    }
}

/// The knobs of a space with the values that it has now.
pub fn knobs(space: &ActionSpace) -> Vec<Knob> {
    let unit = space.unit.name(0);
    let knob = |(name, what, gains): (&'static str, &'static str, &mut Gains)| {
        let own = gains[0];
        let unit = match name {
            "alpha" => format!("{unit} per s"),
            "beta" => format!("{unit} per m and s"),
            _ => unit.to_owned(),
        };
        Knob { name, what, unit, own, range: REACH.map(|part| part * own) }
    };
    places(&mut space.clone()).into_iter().map(knob).collect()
}

impl Setup {
    /// Settings of the environment, the player, and the space's knobs with its own values.
    ///
    /// # Errors
    /// A sentence: what is wrong and what would be right.
    pub fn resolve(&self) -> Result<(EnvConfig, Player, Vec<Knob>), String> {
        let task = self.task()?;
        let (mut config, player) = match self.player.as_str() {
            "script" | "hold" => {
                let space = self.space.parse().map_err(|unknown: aforce::UnknownActionSpace| sentence(&unknown))?;
                let player = if self.player == "hold" { Player::Hold } else { Player::Script };
                (EnvConfig { space, ..EnvConfig::of(task) }, player)
            }
            run => {
                let policy = Policy::of(run)?;
                let made_for = [policy.env.task.as_str(), &policy.env.space.name];
                if made_for != [self.task.as_str(), &self.space] {
                    return Err(format!(
                        "The policy {run} was trained in {} with {}, and cannot play {} with {}.",
                        made_for[0], made_for[1], self.task, self.space
                    ));
                }
                (policy.env.clone(), Player::Policy(Box::new(policy)))
            }
        };
        let knobs = knobs(&config.space);
        for (name, value) in &self.knobs {
            let Some(knob) = knobs.iter().find(|knob| knob.name == name) else {
                let known: Vec<&str> = knobs.iter().map(|knob| knob.name).collect();
                return Err(format!("The space {} has no {name:?} to set. It has {}.", self.space, known.join(", ")));
            };
            within(name, *value, knob.range)?;
            let (_, _, gains) =
                places(&mut config.space).into_iter().find(|(of, ..)| of == name).expect("a knob has its place");
            *gains = gains.map(|_, own| own * value / knob.own);
            if let Stiffness::Adaptive(psi) = &mut config.space.stiffness {
                // The initial K must lie between the new bounds.
                psi.k_0 = psi.k_0.map(|axis, k| k.clamp(psi.k_min[axis].min(psi.k_max[axis]), psi.k_max[axis]));
            }
        }
        let disturbed = |value: f64, neutral: f64| (value != neutral).then_some(Draw::Fixed(value));
        within("friction", self.friction, [0.0, 3.0])?;
        within("payload", self.payload, [0.0, 3.0])?;
        within("table", self.table, [-0.05, 0.05])?;
        within("delay", self.delay, [0.0, 0.05])?;
        config.disturbance.friction = disturbed(self.friction, 1.0);
        config.disturbance.payload_kg = disturbed(self.payload, 0.0);
        config.disturbance.table_height_m = disturbed(self.table, 0.0);
        config.disturbance.torque_delay_s = disturbed(self.delay, 0.0);
        config.validate().map_err(|error| sentence(&error))?;
        Ok((config, player, knobs))
    }

    fn task(&self) -> Result<TaskName, String> {
        let known = TaskName::BUILT_IN;
        known.into_iter().find(|task| task.as_str() == self.task).ok_or_else(|| {
            format!("There is no task {:?} here. There are {}.", self.task, known.map(TaskName::as_str).join(", "))
        })
    }
}

/// Checks that a number lies in its range.
fn within(name: &str, value: f64, [low, high]: [f64; 2]) -> Result<(), String> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(format!("{name} = {value} is not between {low} and {high}."))
    }
}

/// The problem as a sentence, with a capital letter and a full stop.
pub fn sentence(problem: &dyn std::fmt::Display) -> String {
    let text = problem.to_string();
    let mut letters = text.chars();
    let first: String = letters.next().into_iter().flat_map(char::to_uppercase).collect();
    format!("{first}{}.", letters.as_str().trim_end_matches('.'))
}
