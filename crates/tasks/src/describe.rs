//! What an environment consists of, in words.

use std::fmt::Write;

use aforce::{ActionSpace, OperationalSpace, Vector6};

use crate::env::Env;

/// Every entry of action and observation with unit, frame and scaling; the action space's record, and what follows from its
/// numbers.
pub fn describe(env: &Env) -> String {
    let config = env.config();
    let mut text = String::from("action, all entries in [-1, 1]:\n");
    for c in config.space.entries(&config.controller) {
        let line = format!("  {:<28} {:>9.3} .. {:<9.3} {:<8} {}\n", c.name, c.low, c.high, c.unit, c.frame);
        text.push_str(&line);
    }
    if env.task().has_gripper() {
        text += &format!("  {:<28} {:>9} .. {:<9} sign counts\n", "gripper", "open", "close");
    }
    let components = env.observation_components();
    text += &format!("observation ({} numbers), and how a learner scales them:\n", components.len());
    for c in components {
        text += &format!("  {:<28} {:<18} (value - {}) x {}\n", c.name, c.unit, c.centre, c.scale);
    }
    text += &format!("its options: {}\n", options(env));
    text += "eef_pos is the grip site, eef_quat (of which x is never negative) the body right_hand, as in robosuite\n";
    let disturbed = config.disturbance.in_words();
    if !disturbed.is_empty() {
        text += &format!("\ndisturbed, unknown to controller and policy: {disturbed}\n");
    }
    text += &format!("\naction space (a file with these lines is a space too):\n{}", indented(&config.space.to_toml()));
    text += "\nwhat follows from it (translation x, y, z; rotation about x, y, z):\n";
    let y = env.measurement();
    let inertia = OperationalSpace::new(&y.mass, &y.jacobian).map(|arm| arm.diagonal());
    derived(&mut text, env, &config.space, inertia.unwrap_or(Vector6::repeat(1.0)));
    text
}

/// What `env.observation` chooses, and what else could be chosen.
fn options(env: &Env) -> String {
    let seen = &env.config().observation;
    let markers = format!("{:?}", seen.markers).to_lowercase();
    format!("markers = {markers} (condensed, ends or all; Wipe's), controller = {} (its state)", seen.controller)
}

fn derived(text: &mut String, env: &Env, space: &ActionSpace, inertia: Vector6) {
    let mut line = |name: &str, unit: &str, values: &Vector6| {
        let values: Vec<String> = values.iter().map(|value| number(*value)).collect();
        let (translation, rotation) = values.split_at(3);
        writeln!(text, "  {name:<38} {}; {} {unit}", translation.join(", "), rotation.join(", ")).expect("to a string");
    };
    let step = Vector6::from_fn(|axis, _| space.step(&env.config().controller, axis));
    line("apparent inertia at the start", "kg, kg m2", &inertia);
    line("an action of 1", "m, rad", &step);
    line("stiffness at the start", "N/m, Nm/rad", &space.unit.effective(&space.stiffness.at_reset(), &inertia));
    let Some((psi, margins)) = space.psi().zip(space.margins()) else { return };
    let effective = |gains: &Vector6| space.unit.effective(gains, &inertia);
    line("lowest stiffness", "N/m, Nm/rad", &effective(psi.k_min.vector()));
    line("highest stiffness", "N/m, Nm/rad", &effective(psi.k_max.vector()));
    line("spring of F_ff, alpha/mu", "N/m, Nm/rad", &effective(psi.feedforward_spring().vector()));
    line("tolerance, gamma/beta", "m, rad", psi.tolerance().vector());
    line("relaxation, (K_max - K_min)/gamma", "s", psi.relaxation_time().vector());
    line("alpha at which K_min becomes unstable", "as alpha", &Vector6::from_fn(|axis, _| margins[axis].alpha_max));
    if psi.tolerance().vector().iter().zip(&step).all(|(tolerance, step)| tolerance >= step) && space.goal.is_rebased()
    {
        text.push_str(
            "  no action makes a lasting error above the tolerance: K falls to its lower bound and stays there\n",
        );
    }
}

/// Four digits, and no exponent where none is needed.
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
            describe(&Env::new(config, 0).unwrap())
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
