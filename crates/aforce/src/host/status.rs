//! What a cycle reports besides the torque: the status, what was cut, and faults.

use std::ffi::CStr;

use crate::spatial::JointVector;

/// The result of one cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// The torque to send (Nm); finite, within the arm's limits of torque and rate, whatever the status.
    pub tau: JointVector,
    /// Whether the law acts, and what was cut or went wrong.
    pub status: Status,
}

/// The present state of the host.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Status {
    /// The law acts.
    Running,
    /// The law acts, and some of its values were cut.
    Limited(Limited),
    /// Latched: the arm holds its posture, with a stiffness that falls to a low value. Only a new start ends the fault.
    Fault(Fault),
    /// Not started, or stopped: the arm holds its posture, with a stiffness that falls to a low value.
    Stopped,
}

/// What was cut in a sample; several at once are possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Limited(u32);

impl Limited {
    /// A joint's torque or its rate.
    pub const TORQUE: Self = Self(1);
    /// The task's wrench or its rate.
    pub const WRENCH: Self = Self(1 << 1);
    /// The error that spring and adaptation see.
    pub const ERROR: Self = Self(1 << 2);
    /// The latest goal: moved into the workspace, or not taken because no move to it could be planned.
    pub const GOAL: Self = Self(1 << 3);
    /// A joint near the end of its range is pushed back.
    pub const JOINT_RANGE: Self = Self(1 << 4);
    /// The energy tank is low: K grows less, F_ff and F_cmd act in part.
    pub const ENERGY: Self = Self(1 << 5);
    /// Contact is lost: F_cmd fades.
    pub const CONTACT_LOSS: Self = Self(1 << 6);

    /// Whether nothing was cut.
    #[must_use]
    pub fn is_none(self) -> bool {
        self.0 == 0
    }

    /// Whether `other` was cut.
    #[must_use]
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The flags as bits, in the order of the constants.
    #[must_use]
    pub fn bits(self) -> u32 {
        self.0
    }

    pub(crate) fn insert(&mut self, other: Self, cut: bool) {
        if cut {
            self.0 |= other.0;
        }
    }
}

/// Why the law stopped acting. Joints count from 1.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Fault {
    /// A field of the state holds a value that no arm can have.
    #[error("{field} of the arm's state is not finite, or beyond anything an arm has")]
    Unreadable {
        /// Name of the field.
        field: &'static str,
    },
    /// The time since the last cycle is negative, not a number or too long, or it was zero too many times in a row.
    #[error("{period} s since the last cycle; allowed: up to {max}, and 0 a few times in a row")]
    Period {
        /// The time as given (s).
        period: f64,
        /// The largest that is allowed (s).
        max: f64,
    },
    /// The mass matrix is not positive definite, or the law's torque is not finite.
    #[error("the mass matrix is not positive definite, or so small that the law's torque is not finite")]
    Mass,
    /// At the start: the arm's pose differs from the model's at its joint angles.
    #[error(
        "the arm's pose is {distance:.4} m and {angle:.4} rad from the model's kinematics; allowed: {max_distance} m, {max_angle} rad"
    )]
    Kinematics {
        /// Distance between the two positions (m).
        distance: f64,
        /// Angle between the two orientations (rad).
        angle: f64,
        /// Allowed distance (m).
        max_distance: f64,
        /// Allowed angle (rad).
        max_angle: f64,
    },
    /// A joint is outside its range.
    #[error("joint {joint} is at {position:.4} rad; its range: {low} to {high}")]
    JointRange {
        /// 1 to 7.
        joint: usize,
        /// Position of the joint (rad).
        position: f64,
        /// Lower end of the range (rad).
        low: f64,
        /// Upper end of the range (rad).
        high: f64,
    },
    /// A joint is too fast.
    #[error("joint {joint} moves at {speed:.3} rad/s; allowed: {max}")]
    JointSpeed {
        /// 1 to 7.
        joint: usize,
        /// Speed of the joint (rad/s).
        speed: f64,
        /// Allowed speed (rad/s).
        max: f64,
    },
    /// The tool has left the workspace and its margin.
    #[error("the tool is at {axis} = {position:.4} m; allowed: {low:.4} to {high:.4}")]
    Workspace {
        /// x, y or z.
        axis: char,
        /// Position of the tool along the axis (m).
        position: f64,
        /// Lower bound (m).
        low: f64,
        /// Upper bound (m).
        high: f64,
    },
    /// The force that the environment exerts on the tool is above its limit.
    #[error("the environment pushes with {force:.1} N; allowed: {max}")]
    ExternalForce {
        /// Norm of the force (N).
        force: f64,
        /// Allowed norm (N).
        max: f64,
    },
    /// The moment that the environment exerts on the tool is above its limit.
    #[error("the environment turns with {moment:.2} Nm; allowed: {max}")]
    ExternalMoment {
        /// Norm of the moment (Nm).
        moment: f64,
        /// Allowed norm (Nm).
        max: f64,
    },
    /// The mass matrix is not symmetric: an entry differs from its mirror image. Some libraries fill one triangle.
    #[error("the mass matrix has {lower:.4} in row {row}, column {column}, and {upper:.4} in its mirror image")]
    MassAsymmetric {
        /// Row of the entry, 2 to 7.
        row: usize,
        /// Column of the entry, 1 to 6.
        column: usize,
        /// The entry below the diagonal (kg m^2).
        lower: f64,
        /// Its mirror image (kg m^2).
        upper: f64,
    },
    /// The mass matrix gives a joint next to no inertia.
    #[error("the mass matrix gives joint {joint} an inertia of {inertia:.6} kg m^2; allowed: {min} or more")]
    MassFloor {
        /// 1 to 7.
        joint: usize,
        /// Inertia of the joint while the joints before it are free (kg m^2).
        inertia: f64,
        /// Least inertia allowed (kg m^2).
        min: f64,
    },
    /// The rotational part of a column of the Jacobian is not a unit vector.
    #[error("rows 4 to 6 of column {joint} of the Jacobian are {length:.4} long; the axis of a joint has length 1")]
    JacobianAxis {
        /// 1 to 7.
        joint: usize,
        /// Length of the rotational part.
        length: f64,
    },
    /// The motion of a joint does not match its speed.
    #[error("joint {joint} moved by {moved:.4} rad within the last {time} s; its speed says {told:.4}")]
    JointMotion {
        /// 1 to 7.
        joint: usize,
        /// Measured motion of the joint (rad).
        moved: f64,
        /// Motion by the joint's speed (rad).
        told: f64,
        /// Time constant of the sums (s).
        time: f64,
    },
    /// The motion of the tool does not match the Jacobian and the joint speeds.
    #[error(
        "the tool moved by {moved:.4} (m or rad) along {axis} within the last {time} s; Jacobian and joint speeds say {told:.4}"
    )]
    ToolMotion {
        /// x, y, z, rx, ry or rz.
        axis: &'static str,
        /// Measured motion of the tool (m, rad).
        moved: f64,
        /// Motion by the Jacobian and the joint speeds (m, rad).
        told: f64,
        /// Time constant of the sums (s).
        time: f64,
    },
    /// At the start: the torque that holds the arm does not match gravity and wrench.
    #[error(
        "the arm rests with {found:.2} Nm at joint {joint}; gravity, as the law compensates it, and wrench take {expected:.2}, \
         allowed: {max:.2} more or less"
    )]
    RestTorque {
        /// 1 to 7.
        joint: usize,
        /// The torque that the interface took last (Nm).
        found: f64,
        /// The torque that gravity and wrench require (Nm).
        expected: f64,
        /// Allowed difference (Nm).
        max: f64,
    },
    /// After a start at rest: the arm moves as if another gravity torque were left to the law than state and `interface.gravity` say.
    #[error(
        "the arm moves as if {found:.1} Nm of gravity were left to the law (norm over the joints); the state and \
         interface.gravity say {told:.1}"
    )]
    Gravity {
        /// Gravity torque left to the law, estimated from the motion (Nm, component along the reported gravity torque).
        found: f64,
        /// Gravity torque left to the law according to state and `interface.gravity` (Nm, norm over the joints).
        told: f64,
    },
    /// A Coriolis torque that is too large for the speed of the joints.
    #[error("a Coriolis torque of {torque:.2} Nm at joint {joint}; at these speeds at most {max:.2}")]
    Coriolis {
        /// 1 to 7.
        joint: usize,
        /// Reported torque (Nm).
        torque: f64,
        /// Allowed torque at this speed (Nm).
        max: f64,
    },
    /// A field that depends on the joint angles has changed faster than they did.
    #[error("{field} of the arm's state jumped by {change:.3} in a cycle; as its joints moved, at most {max:.3}")]
    Jump {
        /// Name of the field.
        field: &'static str,
        /// Change of the entry that changed most (Jacobian: m/rad or 1; gravity: Nm).
        change: f64,
        /// Allowed change, in the same unit.
        max: f64,
    },
    /// The arm reports a torque that it was not sent.
    #[error(
        "the arm tells that it took {told:.2} Nm at joint {joint}; {sent:.2} Nm was sent, and nothing like it before"
    )]
    TorqueTaken {
        /// 1 to 7.
        joint: usize,
        /// Reported torque (Nm).
        told: f64,
        /// The torque that was sent last (Nm).
        sent: f64,
    },
    /// At the start: the torque that acts on a joint, or the one that holds it, is above the largest that may be sent.
    #[error("joint {joint}: {what} is {torque:.2} Nm; arm.torque_max allows {max}")]
    TorqueMax {
        /// 1 to 7.
        joint: usize,
        /// Which of the two torques.
        what: &'static str,
        /// The torque (Nm).
        torque: f64,
        /// Largest torque allowed, either way (Nm).
        max: f64,
    },
    /// No action came for too long.
    #[error("no action for {silence:.3} s; allowed: {max}")]
    Silence {
        /// Time since the latest action (s).
        silence: f64,
        /// Allowed time (s).
        max: f64,
    },
}

impl Fault {
    /// The number of this kind of fault, from 1. It will not change.
    #[must_use]
    pub fn code(&self) -> u32 {
        match self {
            Self::Unreadable { .. } => 1,
            Self::Period { .. } => 2,
            Self::Mass => 3,
            Self::Kinematics { .. } => 4,
            Self::JointRange { .. } => 5,
            Self::JointSpeed { .. } => 6,
            Self::Workspace { .. } => 7,
            Self::ExternalForce { .. } => 8,
            Self::ExternalMoment { .. } => 9,
            Self::Silence { .. } => 10,
            Self::MassAsymmetric { .. } => 11,
            Self::MassFloor { .. } => 12,
            Self::JacobianAxis { .. } => 13,
            Self::JointMotion { .. } => 14,
            Self::ToolMotion { .. } => 15,
            Self::RestTorque { .. } => 16,
            Self::Gravity { .. } => 17,
            Self::Coriolis { .. } => 18,
            Self::Jump { .. } => 19,
            Self::TorqueTaken { .. } => 20,
            Self::TorqueMax { .. } => 21,
        }
    }

    /// The kind of fault that a [`code`](Self::code) stands for, in words for C programs; `None` if there is no such
    /// code.
    #[must_use]
    pub fn text(code: u32) -> Option<&'static CStr> {
        Some(match code {
            1 => c"a field of the arm's state is not finite, or beyond anything an arm has",
            2 => c"the time since the last cycle is no period, or too long",
            3 => c"the mass matrix is not positive definite, or so small that the law's torque is not finite",
            4 => c"the arm's pose is not the model's",
            5 => c"a joint is outside its range",
            6 => c"a joint is too fast",
            7 => c"the tool has left the workspace",
            8 => c"the environment pushes too hard",
            9 => c"the environment turns too hard",
            10 => c"no action for too long",
            11 => c"the mass matrix is not symmetric",
            12 => c"the mass matrix has a joint without inertia",
            13 => c"a rotational column of the Jacobian has not length 1",
            14 => c"a joint does not move as its speed says",
            15 => c"the tool does not move as Jacobian and joint speeds say",
            16 => c"the torque of the resting arm is not that of gravity and wrench",
            17 => c"the arm moves as if gravity were another",
            18 => c"a Coriolis torque that the joints' speeds cannot make",
            19 => c"Jacobian or gravity jumped",
            20 => c"the arm tells of a torque that it was not sent",
            21 => c"a joint takes more torque at the start than it may be sent",
            _ => return None,
        })
    }
}

/// Why an action was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NotTaken {
    /// The law does not act: not started, stopped, or a fault.
    #[error("the law does not act: the action is not taken")]
    NotRunning,
    /// The action has more or fewer numbers than the space's actions. NaN is no number.
    #[error("an action of {found} numbers, NaN not counted; the space has {expected}")]
    Length {
        /// Length of the action; if that is right, how many of its entries are numbers.
        found: usize,
        /// Length of the space's actions.
        expected: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_a_code_and_a_text() {
        let (joint, position, low, high, max) = (1, 0.0, 0.0, 0.0, 0.0);
        let faults = [
            Fault::Unreadable { field: "q" },
            Fault::Period { period: 0.0, max },
            Fault::Mass,
            Fault::Kinematics { distance: 0.0, angle: 0.0, max_distance: 0.0, max_angle: 0.0 },
            Fault::JointRange { joint, position, low, high },
            Fault::JointSpeed { joint, speed: 0.0, max },
            Fault::Workspace { axis: 'x', position, low, high },
            Fault::ExternalForce { force: 0.0, max },
            Fault::ExternalMoment { moment: 0.0, max },
            Fault::Silence { silence: 0.0, max },
            Fault::MassAsymmetric { row: 2, column: 1, lower: 0.0, upper: 1.0 },
            Fault::MassFloor { joint, inertia: 0.0, min: 1.0 },
            Fault::JacobianAxis { joint, length: 0.0 },
            Fault::JointMotion { joint, moved: 0.0, told: 0.0, time: 0.0 },
            Fault::ToolMotion { axis: "x", moved: 0.0, told: 0.0, time: 0.0 },
            Fault::RestTorque { joint, found: 0.0, expected: 0.0, max },
            Fault::Gravity { found: 0.0, told: 0.0 },
            Fault::Coriolis { joint, torque: 0.0, max },
            Fault::Jump { field: "jacobian", change: 0.0, max },
            Fault::TorqueTaken { joint, told: 0.0, sent: 0.0 },
            Fault::TorqueMax { joint, what: "the torque", torque: 1.0, max },
        ];
        for (fault, code) in faults.iter().zip(1..) {
            assert_eq!(fault.code(), code);
            assert!(Fault::text(code).is_some(), "{fault}");
        }
        assert_eq!((Fault::text(0), Fault::text(faults.len() as u32 + 1)), (None, None));
        assert_eq!(Fault::text(3).unwrap().to_str().unwrap(), Fault::Mass.to_string());
    }
}
