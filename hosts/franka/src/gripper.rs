//! A Franka hand: one thread sends its commands, another reads its width. The control thread waits for neither.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};

use anyhow::{Context, Result, ensure};
use franka::{FrankaResult, Gripper};
use serde::Deserialize;

use crate::protocol::Fingers;

/// Distance below which the fingers hold nothing (m).
const EMPTY: f64 = 0.002;
/// Largest difference by which the opening that a homing finds may be below the set-up's (m). Hands differ by less.
const HOMING: f64 = 0.002;

/// How the gripper moves: the table `robot.gripper` of a set-up.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GripperSetup {
    /// Distance between the fingers of the open gripper (m).
    pub open: f64,
    /// Speed of the fingers (m/s).
    pub speed: f64,
    /// Force with which the gripper grasps (N).
    pub force: f64,
}

impl Default for GripperSetup {
    fn default() -> Self {
        Self { open: 0.08, speed: 0.1, force: 20.0 }
    }
}

impl GripperSetup {
    /// Checks the limits of a Franka hand: fingers 8 cm apart, 10 cm/s, and 70 N of continuous force.
    pub fn validate(&self) -> Result<()> {
        for (key, value, most) in [("open", self.open, 0.08), ("speed", self.speed, 0.1), ("force", self.force, 70.0)] {
            ensure!(
                value > 0.0 && value <= most,
                "robot.gripper.{key} = {value} is not allowed; allowed: above 0, at most {most}"
            );
        }
        Ok(())
    }
}

/// The connected hand.
pub struct Hand {
    fingers: Arc<Shared>,
    orders: SyncSender<()>,
    /// Whether the latest command was to close; `None` before the first.
    closed: Option<bool>,
}

/// What the threads share. `width` has the bits of an `f64` (m).
#[derive(Default)]
struct Shared {
    width: AtomicU64,
    grasped: AtomicBool,
    /// Whether the gripper is to close.
    close: AtomicBool,
    failed: AtomicBool,
}

impl Shared {
    fn tell(&self, width: f64, grasped: bool) {
        self.width.store(width.to_bits(), Ordering::Relaxed);
        self.grasped.store(grasped && width > EMPTY, Ordering::Relaxed);
    }

    /// Marks the gripper as failed, and prints the first error.
    fn fail(&self, error: &dyn std::fmt::Display) {
        if !self.failed.swap(true, Ordering::Relaxed) {
            eprintln!("the gripper: {error}");
        }
    }
}

impl Hand {
    /// Connects to the hand of the robot at `address`. A port in `address` is that of the robot and is left out.
    pub fn connect(address: &str, setup: GripperSetup) -> Result<Self> {
        let gripper = Arc::new(Gripper::new(without_port(address)).context("the gripper")?);
        let state = gripper.read_once().context("the gripper")?;
        ensure!(
            state.max_width >= setup.open - HOMING,
            "robot.gripper.open = {} m; the hand opens by {:.4} m, and knows that only after a homing",
            setup.open,
            state.max_width
        );
        let setup = GripperSetup { open: setup.open.min(state.max_width), ..setup };
        let fingers = Arc::new(Shared::default());
        fingers.tell(state.width, state.is_grasped);

        let (reading, reader) = (Arc::clone(&fingers), Arc::clone(&gripper));
        std::thread::spawn(move || {
            loop {
                match reader.read_once() {
                    Ok(state) => reading.tell(state.width, state.is_grasped),
                    Err(error) => return reading.fail(&error),
                }
            }
        });
        let (orders, received) = sync_channel(1);
        let moving = Arc::clone(&fingers);
        std::thread::spawn(move || {
            for () in received {
                let done = if moving.close.load(Ordering::Relaxed) {
                    closed(gripper.grasp(0.0, setup.speed, setup.force, EMPTY, setup.open))
                } else {
                    opened(gripper.move_gripper(setup.open, setup.speed))
                };
                if let Err(error) = done {
                    return moving.fail(&error);
                }
            }
        });
        Ok(Self { fingers, orders, closed: None })
    }

    /// Closes for an `entry` of an action above 0, opens for one below, as in the tasks. A movement ends before the next one begins.
    pub fn want(&mut self, entry: f64) {
        let close = entry > 0.0;
        if entry == 0.0 || self.closed == Some(close) {
            return;
        }
        self.closed = Some(close);
        self.fingers.close.store(close, Ordering::Relaxed);
        // If the channel is full, the order that waits in it will use this value of `close`.
        let _ = self.orders.try_send(());
    }

    /// The latest state of the hand.
    pub fn fingers(&self) -> Fingers {
        Fingers {
            width: f64::from_bits(self.fingers.width.load(Ordering::Relaxed)),
            grasped: self.fingers.grasped.load(Ordering::Relaxed),
        }
    }

    /// Whether the hand no longer answers, or has failed to carry out a command.
    pub fn has_failed(&self) -> bool {
        self.fingers.failed.load(Ordering::Relaxed)
    }
}

/// A grasp ends where something stops the fingers. Its tolerances allow every width, so that a hand answers `true` even with nothing
/// between the fingers. Therefore the width ([`Shared::tell`]), not the answer, decides whether the hand holds something.
fn closed(answer: FrankaResult<bool>) -> Result<()> {
    answer?;
    Ok(())
}

/// A hand answers `false` if its fingers did not reach the commanded width.
fn opened(answer: FrankaResult<bool>) -> Result<()> {
    ensure!(answer?, "the fingers did not open");
    Ok(())
}

/// The address without its port. An IPv6 address has more than one colon, and is in brackets if a port follows.
fn without_port(address: &str) -> &str {
    if let Some((host, _)) = address.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        return host;
    }
    match address.split_once(':') {
        Some((host, port)) if !port.contains(':') => host,
        _ => address,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_robots_port_is_not_the_grippers() {
        assert_eq!(without_port("172.16.0.2:1337"), "172.16.0.2");
        assert_eq!((without_port("fr3.local"), without_port("fe80::1")), ("fr3.local", "fe80::1"));
        assert_eq!((without_port("[::1]:1337"), without_port("[fe80::1]")), ("::1", "fe80::1"));
    }

    #[test]
    fn what_no_hand_can_do_is_refused() {
        GripperSetup::default().validate().unwrap();
        for (setup, told) in [
            (GripperSetup { open: 0.2, ..Default::default() }, "robot.gripper.open = 0.2"),
            (GripperSetup { speed: 0.0, ..Default::default() }, "robot.gripper.speed = 0"),
            (GripperSetup { force: f64::NAN, ..Default::default() }, "robot.gripper.force = NaN"),
        ] {
            assert!(setup.validate().unwrap_err().to_string().starts_with(told));
        }
    }

    #[test]
    fn fingers_that_do_not_open_are_a_failure_and_an_empty_grasp_is_none() {
        let broken = || Err(franka::FrankaError::Command("aborted".into()));
        assert_eq!(opened(Ok(false)).unwrap_err().to_string(), "the fingers did not open");
        assert!(opened(Ok(true)).is_ok() && closed(Ok(true)).is_ok() && closed(Ok(false)).is_ok());
        assert!(opened(broken()).is_err() && closed(broken()).is_err());
    }

    #[test]
    fn fingers_that_touch_hold_nothing() {
        let shared = Shared::default();
        shared.tell(0.001, true);
        assert!(!shared.grasped.load(Ordering::Relaxed));
        shared.tell(0.03, true);
        assert!(shared.grasped.load(Ordering::Relaxed));
    }
}
