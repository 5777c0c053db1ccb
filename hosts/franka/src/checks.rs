//! What is looked at before a torque flows.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use aforce::host::HostSetup;
use aforce::{JointVector, Vector3};
use anyhow::{Result, bail, ensure};
use franka::{Model, Robot};

use crate::arm::{arm_state, now};

/// The least force that counts as a push (N), and the time to give it.
const PUSH: f64 = 8.0;
const PATIENCE: Duration = Duration::from_secs(20);

/// What an untouched tool may read (N), and the time over which it is looked at.
const REST: f64 = 4.0;
const UNTOUCHED: Duration = Duration::from_millis(500);

/// Refuses to go on after a signal.
pub fn go_on(stop: &AtomicBool) -> Result<()> {
    ensure!(!stop.load(Ordering::Relaxed), "stopped by a signal before the law began");
    Ok(())
}

/// Asks for a push upwards by hand, and refuses a wrench that reads anything else: with the wrong sign or axes contact is never
/// seen, or pressing feeds itself. What is felt before it does not count, and may not be much: a payload that the arm does not know
/// would push for the hand.
pub fn push_by_hand(robot: &Robot, model: &Model, setup: &HostSetup, stop: &AtomicBool) -> Result<()> {
    let read = || -> Result<Vector3> {
        go_on(stop)?;
        let state = arm_state(&robot.read_once()?, model);
        Ok(setup.interface.measurement(&state, &JointVector::zeros()).wrench.fixed_rows::<3>(0).into_owned())
    };
    now(robot)?;
    let (mut rest, mut readings, begin) = (Vector3::zeros(), 0.0, Instant::now());
    while begin.elapsed() < UNTOUCHED {
        rest += read()?;
        readings += 1.0;
    }
    rest /= readings;
    ensure!(
        rest.norm() < REST,
        "untouched the tool reads [{:.1}, {:.1}, {:.1}] N, right would be less than {REST} N: is something in its way, or does the arm not know \
         its payload (set_load)? --no-push-check begins without",
        rest.x,
        rest.y,
        rest.z
    );
    println!("push the tool UPWARDS by hand, harder than {PUSH} N ...");
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        let force = read()? - rest;
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
