//! What a policy is told, and what it answers: one line of JSON each.

use aforce::ActionSpace;
use aforce::host::{Host, Status};
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};

/// Largest number of entries of an action.
const LONGEST: usize = 24;

/// State of the arm that a policy is sent; vectors are in base axes. The control thread fills it, another thread serialises it.
#[derive(Debug, Clone, Serialize)]
pub struct Told {
    /// Number of the episode, from 1.
    pub episode: u32,
    /// Time since the law began in this episode (s).
    pub time: f64,
    /// `running`, `limited`; between episodes `ready`, or how the last one ended.
    pub status: &'static str,
    /// Why the last episode ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Code of the host's fault: [`aforce::host::Fault::code`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<u32>,
    /// What was cut, as the bits of [`aforce::host::Limited`].
    limited: u32,
    /// Joint angles and speeds (rad, rad/s).
    q: [f64; 7],
    qd: [f64; 7],
    /// Position of the tool point (m), and its orientation as a quaternion x, y, z, w.
    position: [f64; 3],
    quaternion: [f64; 4],
    /// The tool's velocity (m/s, rad/s).
    twist: [f64; 6],
    /// Wrench of the environment on the tool (N, Nm).
    wrench: [f64; 6],
    /// K that acts (N/m, Nm/rad), F_ff (N, Nm) and F_d (N).
    stiffness: [f64; 6],
    feedforward: [f64; 6],
    desired_force: f64,
    /// State of the gripper, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    gripper: Option<Fingers>,
}

/// A gripper's state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fingers {
    /// Distance between the fingers (m).
    pub width: f64,
    /// Whether the fingers hold something.
    pub grasped: bool,
}

impl Told {
    /// What `host` has just read; `None` before it has read anything.
    pub fn running(host: &Host, episode: u32, time: f64, status: &Status, gripper: Option<Fingers>) -> Option<Self> {
        let (controller, y) = (host.controller(), host.measurement()?);
        let (status, limited) = match status {
            Status::Limited(limited) => ("limited", limited.bits()),
            _ => ("running", 0),
        };
        Some(Self {
            episode,
            time,
            status,
            reason: None,
            fault: None,
            limited,
            q: y.q.into(),
            qd: y.qd.into(),
            position: y.pose.translation.vector.into(),
            quaternion: y.pose.rotation.coords.into(),
            twist: y.twist.into(),
            wrench: y.wrench.into(),
            stiffness: host.effective_stiffness().into(),
            feedforward: (*controller.feedforward()).into(),
            desired_force: controller.desired_force(),
            gripper,
        })
    }
}

/// What a policy answers with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Answer {
    /// Entries of the action space, then one for the gripper if there is one.
    Action(Action),
    /// A request instead of an action.
    Ask(Ask),
}

/// An action, entries in [-1, 1]; the host clips others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Action {
    entries: [f64; LONGEST],
    length: usize,
}

/// What a policy can ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ask {
    /// End the episode, go back to the start, tell `ready`.
    Reset,
    /// Clear the reflex that has stopped the robot.
    Recover,
    /// End the program.
    End,
}

impl Action {
    /// Its entries.
    pub fn entries(&self) -> &[f64] {
        &self.entries[..self.length]
    }
}

/// The actions that a policy must answer with.
#[derive(Debug, Clone)]
pub struct Expected {
    length: usize,
    /// Name of the action space, for messages.
    name: String,
}

impl Expected {
    /// Actions of `space`, with one entry more for a gripper.
    pub fn new(space: &ActionSpace, gripper: bool) -> Result<Self> {
        let length = space.dim() + usize::from(gripper);
        let name = format!("`{space}`{}", if gripper { " with a gripper" } else { "" });
        ensure!(length <= LONGEST, "actions of {name} have {length} numbers; at most {LONGEST} would be right");
        Ok(Self { length, name })
    }
}

impl Answer {
    /// Reads a line.
    pub fn read(line: &str, expected: &Expected) -> Result<Self> {
        #[derive(Deserialize)]
        #[serde(rename_all = "lowercase")]
        enum Line {
            Action(Vec<f64>),
            Ask(Ask),
        }
        let told = || {
            let shown: String = line.chars().take(60).collect();
            format!("the policy answers {shown:?}; {{\"action\": [..]}} or {{\"ask\": \"reset\"}} would be right")
        };
        match serde_json::from_str(line).with_context(told)? {
            Line::Ask(ask) => Ok(Self::Ask(ask)),
            Line::Action(numbers) => {
                let (found, Expected { length, name }) = (numbers.len(), expected);
                ensure!(found == *length, "the policy answers with {found} numbers, actions of {name} have {length}");
                let mut entries = [0.0; LONGEST];
                entries.iter_mut().zip(&numbers).for_each(|(entry, number)| *entry = *number);
                Ok(Self::Action(Action { entries, length: found }))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use aforce::host::Limited;

    #[test]
    fn a_line_of_json_tells_all() {
        let fingers = Fingers { width: 0.04, grasped: true };
        let status = Status::Limited(Limited::WRENCH);
        let mut told = Told::running(&testing::host(), 3, 1.25, &status, Some(fingers)).unwrap();
        let line: serde_json::Value = serde_json::to_value(&told).unwrap();
        assert_eq!((&line["episode"], &line["time"]), (&3.into(), &1.25.into()));
        assert_eq!((&line["status"], &line["limited"]), (&"limited".into(), &Limited::WRENCH.bits().into()));
        assert_eq!(line["q"][1], -0.8);
        assert_eq!(line["gripper"]["width"], 0.04);
        assert!(line.get("reason").is_none());
        for (key, length) in [("qd", 7), ("position", 3), ("quaternion", 4), ("twist", 6), ("stiffness", 6)] {
            assert_eq!(line[key].as_array().unwrap().len(), length, "{key}");
        }
        told.reason = Some("why".into());
        assert_eq!(serde_json::to_value(&told).unwrap()["reason"], "why");
    }

    #[test]
    fn answers_are_read_or_refused() {
        let expected = Expected { length: 2, name: "`it`".into() };
        let read = |line: &str| Answer::read(line, &expected);
        let Answer::Action(action) = read("{\"action\": [0.5, -1]}").unwrap() else { panic!() };
        assert_eq!(action.entries(), [0.5, -1.0]);
        assert_eq!(read("{\"ask\": \"recover\"}").unwrap(), Answer::Ask(Ask::Recover));
        for line in
            ["", "0 0", "{\"action\": [NaN, 0]}", "{\"ask\": \"dance\"}", "{\"action\": [0, 0], \"ask\": \"end\"}"]
        {
            let error = format!("{:#}", read(line).unwrap_err());
            assert!(error.starts_with(&format!("the policy answers {line:?}; ")), "{error}");
        }
        let error = read("{\"action\": [0]}").unwrap_err().to_string();
        assert_eq!(error, "the policy answers with 1 numbers, actions of `it` have 2");
        for space in ActionSpace::built_in() {
            assert_eq!(Expected::new(&space, true).unwrap().length, space.dim() + 1);
        }
    }
}
