//! What is looked at before a torque flows.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use aforce::JointVector;
use aforce::host::HostSetup;
use anyhow::{Result, bail, ensure};
use franka::{Model, Robot};

use crate::arm::arm_state;

/// A push that is meant (N), and the time to give it.
const PUSH: f64 = 8.0;
const PATIENCE: Duration = Duration::from_secs(20);

/// Refuses to go on after a signal.
pub fn go_on(stop: &AtomicBool) -> Result<()> {
    ensure!(!stop.load(Ordering::Relaxed), "stopped by a signal before the law began");
    Ok(())
}

/// Asks for a push upwards by hand, and refuses a wrench that reads anything else: with the wrong sign or axes contact is never
/// seen, or pressing feeds itself.
pub fn push_by_hand(robot: &Robot, model: &Model, setup: &HostSetup, stop: &AtomicBool) -> Result<()> {
    println!("push the tool UPWARDS by hand, harder than {PUSH} N ...");
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        go_on(stop)?;
        let state = arm_state(&robot.read_once()?, model);
        let wrench = setup.interface.measurement(&state, &JointVector::zeros()).wrench;
        let force = wrench.fixed_rows::<3>(0);
        let axis = force.iamax();
        let strength = force[axis];
        if strength.abs() < PUSH {
            continue;
        }
        if axis == 2 && strength > 0.0 {
            println!("felt {strength:.1} N upwards: sign and axes are right");
            return Ok(());
        }
        let axis = ["x", "y", "z"][axis];
        bail!(
            "a push upwards reads {strength:.1} N along {axis}; right would be more than +{PUSH} N along z: look at \
             interface.wrench_sign and wrench_axes in the set-up"
        );
    }
    bail!("no push of {PUSH} N was felt within {} s (--no-push-check begins without)", PATIENCE.as_secs())
}
