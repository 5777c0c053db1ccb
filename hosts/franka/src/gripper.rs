//! A Franka hand: one thread sends it what is wanted, another reads its width. Neither is the control thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};

use anyhow::{Context, Result, ensure};
use franka::{FrankaResult, Gripper};
use serde::Deserialize;

use crate::protocol::Fingers;

/// Fingers nearer to each other than this hold nothing (m).
const EMPTY: f64 = 0.002;
/// The widest opening that a homing finds may be narrower than the set-up asks, by so much (m): hands differ by less.
const HOMING: f64 = 0.002;

/// How it moves: the table `robot.gripper` of a set-up.
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
    /// The fingers of a Franka hand go 8 cm apart, move with up to 10 cm/s, and press with up to 70 N for as long as one likes.
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
    /// What was wanted last.
    closed: Option<bool>,
}

/// What the threads tell each other.
#[derive(Default)]
struct Shared {
    width: AtomicU64,
    grasped: AtomicBool,
    /// To be closed.
    close: AtomicBool,
    failed: AtomicBool,
}

impl Shared {
    fn tell(&self, width: f64, grasped: bool) {
        self.width.store(width.to_bits(), Ordering::Relaxed);
        self.grasped.store(grasped && width > EMPTY, Ordering::Relaxed);
    }

    /// Says why, once.
    fn fail(&self, error: &dyn std::fmt::Display) {
        if !self.failed.swap(true, Ordering::Relaxed) {
            eprintln!("the gripper: {error}");
        }
    }
}

impl Hand {
    /// Connects to the hand of the robot at `address`, whose port is the robot's own.
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
        // If the channel is full, the order that waits in it will be carried out with this wish.
        let _ = self.orders.try_send(());
    }

    /// How it is.
    pub fn fingers(&self) -> Fingers {
        Fingers {
            width: f64::from_bits(self.fingers.width.load(Ordering::Relaxed)),
            grasped: self.fingers.grasped.load(Ordering::Relaxed),
        }
    }

    /// Whether it does not answer, or has failed to do what it was told.
    pub fn has_failed(&self) -> bool {
        self.fingers.failed.load(Ordering::Relaxed)
    }
}

/// A grasp ends where something stops the fingers. Its tolerances allow every width, so that a hand answers `true` also with nothing
/// between them: whether it holds something is told by the width ([`Shared::tell`]) and not by the answer.
fn closed(answer: FrankaResult<bool>) -> Result<()> {
    answer?;
    Ok(())
}

/// A hand answers `false` where its fingers did not come to the width that it was told.
fn opened(answer: FrankaResult<bool>) -> Result<()> {
    ensure!(answer?, "the fingers did not open");
    Ok(())
}

/// An address of version 6 has more than one colon, and stands in brackets before a port.
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
