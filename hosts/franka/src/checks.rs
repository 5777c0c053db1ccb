//! Checks before the first torque is sent.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use aforce::host::HostSetup;
use aforce::{JointVector, Vector3};
use anyhow::{Result, bail, ensure};
use franka::{Model, Robot};

use crate::arm::{arm_state, now};

/// Smallest force that counts as a push (N), and the time in which the push has to come.
const PUSH: f64 = 8.0;
const PATIENCE: Duration = Duration::from_secs(20);

/// Largest mean force of an untouched tool (N), and the time over which the mean is taken.
const REST: f64 = 4.0;
const UNTOUCHED: Duration = Duration::from_millis(500);

/// Refuses to go on after a signal.
pub fn go_on(stop: &AtomicBool) -> Result<()> {
    ensure!(!stop.load(Ordering::Relaxed), "stopped by a signal before the law began");
    Ok(())
}

/// Asks for a push upwards by hand, and refuses a wrench that reads another direction: with a wrong sign or wrong axes contact is never
/// detected, or pressing amplifies itself. The mean force before the push is subtracted and must be small, so that the weight of an unknown
/// payload is not taken for the push.
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
            "a push upwards reads {strength:.1} N along {axis}; right would be more than +{PUSH} N along z: does the \
             arm stand upright, and was the tool pushed upwards?"
        );
    }
    bail!("no push of {PUSH} N was felt within {} s (--no-push-check begins without)", PATIENCE.as_secs())
}
