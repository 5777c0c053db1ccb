//! The next waypoint of a task's script, read from a dict.

use aforce::{Measurement, Pose, Vector3};
use nalgebra::Translation3;
use pyo3::prelude::*;
use serde::Deserialize;
use tasks::{Waypoint, nearest_straight_down};

use super::answer::Part;
use super::bodies::pose;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Spec {
    /// Position of the tool point (m, world).
    position: [f64; 3],
    /// Direction along which the fingers open, the hand straight down.
    forward: Option<[f64; 3]>,
    /// How many turns of the hand about z, evenly apart, do equally well.
    turns: Option<u32>,
    /// Orientation of the tool: x, y, z, w.
    quaternion: Option<[f64; 4]>,
    #[serde(default)]
    grip: f64,
    #[serde(default)]
    force: f64,
}

/// Reads a waypoint. Without `forward` and `quaternion` the hand keeps its rotation.
///
/// # Errors
/// `TypeError` for an unknown key, `ValueError` for a value that is not allowed.
pub fn read(part: Part<'_>, value: &Bound<'_, PyAny>, y: &Measurement) -> PyResult<Waypoint> {
    let Spec { position, forward, turns, quaternion, grip, force } = part.read(value, "")?;
    let finite =
        position.iter().chain(&forward.unwrap_or_default()).chain([&grip, &force]).all(|number| number.is_finite());
    if !finite {
        return Err(part.value("a waypoint that is not finite"));
    }
    if !(-1.0..=1.0).contains(&grip) {
        return Err(part.value(format!("grip {grip}; -1 (opens) to 1 (closes) is wanted")));
    }
    if let Some(forward) = forward.filter(|forward| Vector3::from(*forward).xy().norm() <= 1e-6 * forward[2].abs()) {
        return Err(part.value(format!("forward {forward:?}; a direction that is not straight up or down is wanted")));
    }
    if force < 0.0 {
        return Err(part.value(format!("force {force}; a force to press with (N), 0 or above, is wanted")));
    }
    if turns.is_some_and(|turns| !(1..=360).contains(&turns) || forward.is_none()) {
        return Err(part.value("turns; 1 to 360 are wanted, and forward beside it"));
    }
    let rotation = match (forward, quaternion) {
        (None, None) => y.pose.rotation,
        (Some(forward), None) => nearest_straight_down(&Vector3::from(forward), turns.unwrap_or(1), &y.pose.rotation),
        (None, Some([i, j, k, w])) => pose(&[0.0, 0.0, 0.0, i, j, k, w]).map_err(|words| part.value(words))?.rotation,
        (Some(_), Some(_)) => return Err(part.value("forward and quaternion; one of them is wanted")),
    };
    Ok(Waypoint { pose: Pose::from_parts(Translation3::from(Vector3::from(position)), rotation), grip, force })
}
