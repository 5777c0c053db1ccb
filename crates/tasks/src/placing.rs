//! Puts the arm where an episode begins, and checks that the arm overlaps nothing there.

use aforce::{ConfigError, JointVector};
use physics::Simulation;
use physics::robots::Robot;
use rand_chacha::ChaCha8Rng;

use crate::normal::standard_normal;
use crate::start::{Fingers, Start};
use crate::task::Task;

/// Overlap from which a start is refused (m): the engine would throw the arm off. Wipe's soft tool is no exception: 10 mm
/// deep in the table it would press with 450 N before the first action.
pub(crate) const LARGEST_OVERLAP: f64 = 1e-3;

/// Number of starts that are drawn before a scene counts as one without room for the arm.
const MOST_STARTS: u32 = 1000;

/// Names of the two geoms that overlap most.
pub(crate) fn overlapping(simulation: &Simulation) -> String {
    let deepest = simulation.overlaps(0.0).into_iter().max_by(|a, b| a.depth.total_cmp(&b.depth));
    deepest.map_or_else(String::new, |overlap| overlap.geoms.join(" and "))
}

/// Puts the arm at `q` (rad), the task's joints where the task wants them, and the fingers and what they hold as `start` says.
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
/// If a start angle is out of its joint's range.
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
/// has no overlap of [`LARGEST_OVERLAP`] or more.
///
/// # Errors
/// If the task's start is out of a joint's range, or if there is no room for the arm.
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
        // The seventh joint, which an arm of six joints does not have, stays where it is.
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
