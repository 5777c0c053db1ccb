//! What an environment consists of, in words and as data.

use std::fmt::Write;

use aforce::{ActionEntry, JointVector, LoopOnArm, OperationalSpace, Vector6, Wrench};
use serde::Serialize;

use crate::env::Env;
use crate::env_config::EnvConfig;
use crate::observation::CLIP;
use crate::observer::Component;
use crate::pixels::PixelForm;

/// What an environment consists of.
#[derive(Debug, Clone, Serialize)]
pub struct Description {
    /// The entries of an action, all in [-1, 1].
    pub action: Vec<ActionEntry>,
    /// The numbers of an observation.
    pub observation: Vec<Component>,
    /// The further numbers that only a critic sees.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub critic: Vec<Component>,
    /// The form of the observed pictures, if there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixels: Option<PixelForm>,
    /// Largest magnitude of a scaled number of an observation.
    pub scaled_limit: f32,
    /// Names of the terms that add up to a reward.
    pub reward_terms: Vec<&'static str>,
    /// Quantities that follow from the numbers of the action space, with the arm at its home pose.
    pub derived: Vec<Derived>,
    /// All settings, the action space's record among them.
    pub env: EnvConfig,
}

/// A quantity that follows from the numbers of the action space.
#[derive(Debug, Clone, Serialize)]
pub struct Derived {
    /// Name of the quantity.
    pub name: &'static str,
    /// Units of translation and rotation.
    pub unit: &'static str,
    /// Translation along x, y, z; rotation about x, y, z.
    pub values: Vector6,
}

impl Description {
    /// Every entry of action and observation with unit, frame and scaling; the settings, and what follows from the action
    /// space's numbers.
    pub fn of(env: &Env) -> Self {
        Self {
            action: env.action_entries(),
            observation: env.observation_components().to_vec(),
            critic: env.privileged_components().to_vec(),
            pixels: env.config().observation.camera.map(|camera| camera.form()),
            scaled_limit: CLIP,
            reward_terms: env.reward_terms().collect(),
            derived: derived(env),
            env: env.config().clone(),
        }
    }

    /// The description as text.
    pub fn in_words(&self) -> String {
        let mut text = String::from("action, all entries in [-1, 1]:\n");
        for c in &self.action {
            let line = format!("  {:<28} {:>9.3} .. {:<9.3} {:<8} {}\n", c.name, c.low, c.high, c.unit, c.frame);
            text.push_str(&line);
        }
        text += &format!("observation ({} numbers), and how a learner scales them:\n", self.observation.len());
        text += &listed(&self.observation);
        if !self.critic.is_empty() {
            text += &format!("what only a critic sees ({} numbers):\n", self.critic.len());
            text += &listed(&self.critic);
        }
        if let Some(PixelForm { shape: [rows, columns, channels], high, unit }) = self.pixels {
            text += &format!("pixels ({rows} rows of {columns}, {channels} numbers each), 0 to {high} {unit}\n");
        }
        text += &format!("its options: {}\n", self.env.observation.in_words());
        text +=
            "eef_pos is the grip site, eef_quat (of which x is never negative) the body right_hand, as in robosuite\n";
        let disturbed = self.env.disturbance.in_words();
        if !disturbed.is_empty() {
            text += &format!("\ndisturbed, unknown to controller and policy: {disturbed}\n");
        }
        let record = indented(&self.env.space.to_toml());
        text += &format!("\naction space (a file with these lines is a space too):\n{record}");
        text += "\nwhat follows from it at the home pose (translation x, y, z; rotation about x, y, z):\n";
        for Derived { name, unit, values } in &self.derived {
            let values: Vec<String> = values.iter().map(|value| number(*value)).collect();
            let (translation, rotation) = values.split_at(3);
            let (translation, rotation) = (translation.join(", "), rotation.join(", "));
            writeln!(text, "  {name:<38} {translation}; {rotation} {unit}").expect("to a string");
        }
        let relaxes = self.env.space.psi().is_some_and(|psi| psi.gamma.vector().max() > 0.0);
        let rises = |line: &Derived| line.name == RISE && line.values.iter().any(|time| time.is_finite());
        if relaxes && !self.derived.iter().any(rises) {
            text += "  no lasting error is above the tolerance: K falls to its lower bound and stays there\n";
        }
        text
    }
}

/// A line for each component.
fn listed(components: &[Component]) -> String {
    let line = |c: &Component| format!("  {:<28} {:<18} (value - {}) x {}\n", c.name, c.unit, c.centre, c.scale);
    components.iter().map(line).collect()
}

/// Upper end of the search for a limit on alpha, where an axis by itself has no limit.
const HIGHEST_ALPHA: f64 = 1e6;

const RISE: &str = "rise of K under it, from floor to top";

fn derived(env: &Env) -> Vec<Derived> {
    let EnvConfig { space, controller, .. } = env.config();
    let y = env.simulation().model().measure(env.robot().home, JointVector::zeros(), Wrench::zeros());
    let inertia = OperationalSpace::new(&y.mass, &y.jacobian).map_or(Vector6::repeat(1.0), |arm| arm.diagonal());
    let effective = |gains: &Vector6| space.unit.effective(gains, &inertia);
    let mut list = vec![];
    let mut line = |name, unit, values| list.push(Derived { name, unit, values });
    line("apparent inertia", "kg, kg m2", inertia);
    line("an action of 1", "m, rad", Vector6::from_fn(|axis, _| space.step(controller, axis)));
    line("stiffness at the start", "N/m, Nm/rad", effective(&space.stiffness.at_reset()));
    if let Some((psi, margins)) = space.psi().zip(space.margins()) {
        line("lowest stiffness", "N/m, Nm/rad", effective(psi.k_min.vector()));
        line("highest stiffness", "N/m, Nm/rad", effective(psi.k_max.vector()));
        line("spring of F_ff, alpha/mu", "N/m, Nm/rad", effective(psi.feedforward_spring().vector()));
        line("tolerance, gamma/beta", "m, rad", *psi.tolerance().vector());
        let furthest = Vector6::from_fn(|axis, _| {
            space.goal.furthest(axis, space.step(controller, axis)).unwrap_or(f64::INFINITY)
        });
        line("largest error that lasts", "m, rad", furthest);
        line(RISE, "s", Vector6::from_fn(|axis, _| psi.rise_time(axis, furthest[axis])));
        line("relaxation, (K_max - K_min)/gamma", "s", *psi.relaxation_time().vector());
        let alone = Vector6::from_fn(|axis, _| margins[axis].alpha_max);
        let arm = LoopOnArm::new(space, &y);
        let limit = Vector6::from_fn(|axis, _| {
            let most = alone[axis].min(HIGHEST_ALPHA);
            let found = arm.as_ref().map_or(most, |arm| arm.limit(axis / 3 * 3, most));
            if found < most { found } else { alone[axis] }
        });
        line("alpha at which K_min becomes unstable", space.unit.alpha_name(), limit);
    }
    list
}

/// Four significant digits, but every digit before the point and at most six after it; no exponent.
fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = (3 - libm::log10(value.abs()).floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

fn indented(text: &str) -> String {
    text.lines().map(|line| if line.is_empty() { "\n".into() } else { format!("  {line}\n") }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EnvConfig;

    #[test]
    fn the_record_stands_in_the_text_and_so_does_what_follows() {
        let text = |space: &str, step: f64| {
            let mut config = EnvConfig { space: space.parse().unwrap(), ..EnvConfig::default() };
            (config.controller.position_step, config.controller.rotation_step) = (step, 10.0 * step);
            Description::of(&Env::new(config, 0).unwrap()).in_words()
        };
        let aforce = text("aforce", 0.05);
        for part in ["k_min = [300.0, 20.0]", "0.0375, 0.0375, 0.0375; 0.275, 0.275, 0.275 m, rad", "delta_rz"] {
            assert!(aforce.contains(part), "{part} in {aforce}");
        }
        assert!(!aforce.contains("stays there") && text("aforce", 0.02).contains("stays there"));
        let osc = text("osc", 0.05);
        assert!(osc.contains("fixed = 150.0") && !osc.contains("tolerance"), "{osc}");
    }

    #[test]
    fn numbers_have_four_digits() {
        assert_eq!([0.0375, 23.41234, 1830.4, 0.0, 1e-9].map(number), ["0.0375", "23.41", "1830", "0", "0"]);
    }
}
