//! Where the arm stands when an episode begins, and that it stands in nothing's way.

use aforce::{ConfigError, JointVector};
use physics::Simulation;
use physics::robots::Robot;
use rand_chacha::ChaCha8Rng;

use crate::normal::standard_normal;
use crate::start::{Fingers, Start};
use crate::task::Task;

/// Overlap at which the engine would throw the arm off instead of starting an episode (m).
pub(crate) const LARGEST_OVERLAP: f64 = 1e-3;

/// Starts that are drawn before a scene counts as one without room for the arm.
const MOST_STARTS: u32 = 1000;

/// The geoms that lie deepest in one place, by their names.
pub(crate) fn overlapping(simulation: &Simulation) -> String {
    let deepest = simulation.overlaps(0.0).into_iter().max_by(|a, b| a.depth.total_cmp(&b.depth));
    deepest.map_or_else(String::new, |overlap| overlap.geoms.join(" and "))
}

/// Puts the arm at `q` (rad), the task's joints where it wants them, and the fingers and what they hold as `start` says.
pub(crate) fn put(simulation: &mut Simulation, task: &dyn Task, start: &Start, q: &JointVector) {
    simulation.reset(q);
    task.arrange(simulation);
    match start.fingers {
        Fingers::HalfOpen => {}
        Fingers::Apart(distance) => simulation.open_fingers(distance),
        Fingers::Holding { body, grip, width } => simulation.put_in_hand(body, &grip, width),
    }
}

/// How the task starts the arm.
///
/// # Errors
/// If that is out of a joint's range.
pub(crate) fn start_of(task: &dyn Task, robot: &Robot) -> Result<Start, ConfigError> {
    let start = task.start(robot);
    for (joint, (q, [low, high])) in start.q.iter().zip(robot.arm.range).enumerate().take(robot.joints) {
        if !(low..=high).contains(q) {
            let reason =
                format!("{} starts with joint {} at {q} rad; allowed: {low} to {high}", task.name(), joint + 1);
            return Err(ConfigError::Contradiction { field: "env.task".into(), reason });
        }
    }
    Ok(start)
}

/// Draws joint angles, with a standard deviation of `noise` (rad) about those of the task, until they are within their ranges and the arm
/// stands in nothing's way.
///
/// # Errors
/// If the task has the arm start out of its range, or if there is no room for the arm.
pub(crate) fn draw_start(
    simulation: &mut Simulation,
    task: &dyn Task,
    robot: &Robot,
    noise: f64,
    rng: &mut ChaCha8Rng,
) -> Result<(), ConfigError> {
    let start = start_of(task, robot)?;
    // Without noise every start is the same.
    let tries = if noise == 0.0 { 1 } else { MOST_STARTS };
    for _ in 0..tries {
        let mut q = start.q.map(|q| q + noise * standard_normal(rng));
        // A seventh joint that there is not stays where it is.
        q.iter_mut().zip(&start.q).skip(robot.joints).for_each(|(q, start)| *q = *start);
        if q.iter().zip(robot.arm.range).all(|(q, [low, high])| (low..=high).contains(q)) {
            put(simulation, task, &start, &q);
            if simulation.overlap() < LARGEST_OVERLAP {
                return Ok(());
            }
        }
    }
    let (name, geoms) = (task.name(), overlapping(simulation));
    let reason = format!(
        "{geoms} overlap at the start of {name} (the last of {tries} poses of the arm that were tried): leave room there"
    );
    Err(ConfigError::Contradiction { field: "env.task".into(), reason })
}
