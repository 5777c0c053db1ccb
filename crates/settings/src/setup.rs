//! Named set-ups: how far an action may go, the same for every action space.

use aforce::GoalRule;
use anyhow::{Result, bail};
use tasks::EnvConfig;
use toml::Table;

/// Name, how far an action entry of 1 moves the goal (m, rad), and what for.
pub const SETUPS: [(&str, [f64; 2], &str); 2] = [
    ("paper-steps", [0.05, 0.5], "robosuite's action steps, which the paper has (default)"),
    ("small-steps", [0.02, 0.15], "less than half of them: calmer, and learned sooner"),
];

/// The settings that a name stands for.
///
/// # Errors
/// If it is unknown.
pub fn settings(name: &str) -> Result<Table> {
    let Some((_, [position, rotation], _)) = SETUPS.iter().find(|setup| setup.0 == name) else {
        bail!("setup = {name:?}: known are {}", SETUPS.map(|setup| setup.0).join(", "));
    };
    let text = format!("[env.controller]\nposition_step = {position}\nrotation_step = {rotation}");
    Ok(text.parse().expect("two keys"))
}

/// The set-up of a configuration, in words.
pub fn in_words(env: &EnvConfig) -> String {
    let steps = [0, 3].map(|axis| env.space.step(&env.controller, axis));
    // Of 0.07 m, 7 cm and no 7.000000000000001.
    let centimetres = (1e8 * steps[0]).round() / 1e6;
    let reach = format!("up to {centimetres} cm and {} rad", steps[1]);
    if matches!(env.space.goal, GoalRule::Absolute { .. }) {
        return format!("own reach: an action puts the goal {reach} from the start");
    }
    let name = SETUPS.iter().find(|setup| setup.1 == steps).map_or("own steps", |setup| setup.0);
    format!("{name}: an action moves the goal by {reach}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_has_a_name() {
        let words = in_words(&EnvConfig::default());
        assert_eq!(words, "paper-steps: an action moves the goal by up to 5 cm and 0.5 rad");
        let mut env = EnvConfig::default();
        env.controller.position_step = 0.07;
        assert_eq!(in_words(&env), "own steps: an action moves the goal by up to 7 cm and 0.5 rad");
        env.space.goal =
            GoalRule::Absolute { reach_position: 0.3, reach_rotation: 0.6, leash_position: 0.1, leash_rotation: 0.3 };
        assert_eq!(in_words(&env), "own reach: an action puts the goal up to 30 cm and 0.6 rad from the start");
        assert!(settings("large-steps").unwrap_err().to_string().contains("paper-steps, small-steps"));
    }
}
