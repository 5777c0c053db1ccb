//! Named set-ups: how far an action may go and what ends an episode, the same for every action space.

use aforce::GoalRule;
use anyhow::{Result, bail};
use tasks::EnvConfig;
use toml::{Table, Value};

/// A named set-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// What it is called.
    pub name: &'static str,
    /// How far an action entry of 1 moves the goal (m, rad).
    pub steps: [f64; 2],
    /// Whether an episode ends where a real arm would have stopped itself.
    pub stops: bool,
    /// What it is for.
    pub purpose: &'static str,
}

/// All named set-ups.
pub const SETUPS: [Setup; 3] = [
    Setup {
        name: "paper-steps",
        steps: [0.05, 0.5],
        stops: false,
        purpose: "robosuite's action steps, which the paper has (default)",
    },
    Setup { name: "small-steps", steps: [0.02, 0.15], stops: false, purpose: "less than half of them: slow and calm" },
    Setup {
        name: "solve",
        steps: [0.044, 0.11],
        stops: true,
        purpose: "to solve a task: the study's tuned steps of Lift, and an arm that stops itself as a real one does",
    },
];

/// The settings that a name stands for.
///
/// # Errors
/// If it is unknown.
pub fn settings(name: &str) -> Result<Table> {
    let Some(Setup { steps: [position, rotation], stops, .. }) = SETUPS.iter().find(|setup| setup.name == name) else {
        bail!("setup = {name:?}: known are {}", SETUPS.map(|setup| setup.name).join(", "));
    };
    let text =
        format!("[env]\nstops = {stops}\n[env.controller]\nposition_step = {position}\nrotation_step = {rotation}");
    Ok(text.parse().expect("three keys"))
}

/// Removes from `below` what every set-up sets, so that a set-up above it counts.
pub fn make_room(below: &mut Table) {
    remove(below, &settings(SETUPS[0].name).expect("a known set-up"));
}

/// Removes the keys of `keys` from `table`, and the tables that are empty then.
fn remove(table: &mut Table, keys: &Table) {
    table.retain(|key, value| match (keys.get(key), value) {
        (None, _) => true,
        (Some(Value::Table(keys)), Value::Table(inner)) => {
            remove(inner, keys);
            !inner.is_empty()
        }
        // A number in the place of a table is an error, which is not hidden here.
        (Some(Value::Table(_)), _) => true,
        (Some(_), _) => false,
    });
}

/// The set-up of a configuration, in words.
pub fn in_words(env: &EnvConfig) -> String {
    let steps = [0, 3].map(|axis| env.space.step(&env.controller, axis));
    // Rounded, so that 0.07 m are 7 cm and not 7.000000000000001 cm.
    let centimetres = (1e8 * steps[0]).round() / 1e6;
    let reach = format!("up to {centimetres} cm and {} rad", steps[1]);
    let stops = if env.stops { "; the arm stops itself as a real one does" } else { "" };
    if matches!(env.space.goal, GoalRule::Absolute { .. }) {
        return format!("own reach: an action puts the goal {reach} from the start{stops}");
    }
    let known = SETUPS.iter().find(|setup| (setup.steps, setup.stops) == (steps, env.stops));
    let name = known.map_or("own set-up", |setup| setup.name);
    format!("{name}: an action moves the goal by {reach}{stops}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A set-up is recognised by the values that its name sets.
    #[test]
    fn a_set_up_is_told_by_its_name() {
        for Setup { name, steps, stops, .. } in SETUPS {
            let mut env = EnvConfig { stops, ..EnvConfig::default() };
            [env.controller.position_step, env.controller.rotation_step] = steps;
            assert!(in_words(&env).starts_with(&format!("{name}: ")), "{}", in_words(&env));
            let table = settings(name).unwrap();
            let number = |key: &str| table["env"]["controller"][key].as_float().unwrap();
            assert_eq!([number("position_step"), number("rotation_step")], steps);
            assert_eq!(table["env"]["stops"].as_bool(), Some(stops));
        }
    }

    #[test]
    fn room_is_made_for_all_that_a_set_up_sets_and_nothing_else() {
        for Setup { name, .. } in SETUPS {
            let mut table = settings(name).unwrap();
            make_room(&mut table);
            assert!(table.is_empty(), "{name}: {table:?}");
        }
        let text =
            "steps = 3\nenv = { stops = true, horizon = 9, controller = { position_step = 0.1, policy_hz = 10 } }";
        let mut table: Table = text.parse().unwrap();
        make_room(&mut table);
        assert_eq!(table, "steps = 3\nenv = { horizon = 9, controller = { policy_hz = 10 } }".parse().unwrap());
    }

    #[test]
    fn the_default_has_a_name() {
        let words = in_words(&EnvConfig::default());
        assert_eq!(words, "paper-steps: an action moves the goal by up to 5 cm and 0.5 rad");
        let mut env = EnvConfig::default();
        env.controller.position_step = 0.07;
        assert_eq!(in_words(&env), "own set-up: an action moves the goal by up to 7 cm and 0.5 rad");
        env.space.goal =
            GoalRule::Absolute { reach_position: 0.3, reach_rotation: 0.6, leash_position: 0.1, leash_rotation: 0.3 };
        assert_eq!(in_words(&env), "own reach: an action puts the goal up to 30 cm and 0.6 rad from the start");
        assert!(settings("large-steps").unwrap_err().to_string().contains("paper-steps, small-steps, solve"));
    }
}
