//! When, and why, a real arm would have stopped itself.

use aforce::{Arm, ConfigError, JointVector, within};
use physics::ContactReading;
use serde::{Deserialize, Serialize};

/// The limits beyond which a real arm stops itself. A simulated arm goes on, unless
/// [`EnvConfig::stops`](crate::EnvConfig::stops).
///
/// The defaults are a Panda's: Franka's control-interface documentation gives the joint speeds at which it stops and its
/// self-collision avoidance. A force threshold is the user's to set: Franka's examples set 20 to 40 N, and 100 N is at the upper
/// end of what people use.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Protection {
    /// A joint must not turn faster than this share of its limit ([`Arm::speed_max`]): of a Panda 2.175 rad/s for joints 1 to 4,
    /// 2.61 for 5 to 7.
    pub joint_speed: f64,
    /// The sustained force beyond the wrist must not exceed this (N).
    pub hand_force: f64,
    /// The sum of the sustained forces on the links short of the wrist must not exceed this (N).
    pub link_force: f64,
    /// Two parts of the arm must not press on each other.
    pub self_contact: bool,
}

impl Default for Protection {
    fn default() -> Self {
        Protection { joint_speed: 1.0, hand_force: 100.0, link_force: 100.0, self_contact: true }
    }
}

/// Why a real arm would have stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopReason {
    /// A joint turned too fast.
    JointSpeed,
    /// Too large a force beyond the wrist.
    HandForce,
    /// Too large a force on the links short of the wrist.
    LinkForce,
    /// The arm touched itself.
    SelfContact,
}

impl StopReason {
    /// Name in tables and messages.
    pub fn as_str(self) -> &'static str {
        match self {
            StopReason::JointSpeed => "joint-speed",
            StopReason::HandForce => "hand-force",
            StopReason::LinkForce => "link-force",
            StopReason::SelfContact => "self-contact",
        }
    }
}

impl Protection {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is not allowed, with its field (below `protection`) and range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let Self { joint_speed, hand_force, link_force, self_contact: _ } = *self;
        within("protection.joint_speed", joint_speed, 0.01..=100.0)?;
        within("protection.hand_force", hand_force, 0.0..=1e6)?;
        within("protection.link_force", link_force, 0.0..=1e6)
    }

    /// Why a real arm would stop now; `None` if it would not. `speed` is the speed of the joint nearest to its limit, as a share of this
    /// limit. Of several reasons the first in the order of [`StopReason`] is returned.
    pub fn stop(&self, speed: f64, contact: &ContactReading) -> Option<StopReason> {
        [
            (speed > self.joint_speed, StopReason::JointSpeed),
            (contact.hand_force() > self.hand_force, StopReason::HandForce),
            (contact.links.sustained > self.link_force, StopReason::LinkForce),
            (self.self_contact && contact.touching_itself, StopReason::SelfContact),
        ]
        .into_iter()
        .find_map(|(stops, reason)| stops.then_some(reason))
    }
}

/// Speed of the joint of `arm` that is nearest to its limit, as a share of that limit; `qd` in rad/s.
pub fn speed_share(qd: &JointVector, arm: &Arm) -> f64 {
    qd.iter().zip(arm.speed_max).fold(0.0, |most, (qd, limit)| f64::max(most, qd.abs() / limit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use aforce::Wrench;
    use physics::LinkReading;

    #[test]
    fn a_panda_stops_for_each_of_four_reasons_and_not_short_of_them() {
        let protection = Protection::default();
        let pushed = |hand: f64, links: f64| ContactReading {
            sustained: Wrench::new(0.0, 0.6 * hand, -0.8 * hand, 500.0, 0.0, 0.0),
            links: LinkReading { sustained: links, ..LinkReading::default() },
            ..ContactReading::default()
        };
        let itself = ContactReading { touching_itself: true, ..ContactReading::default() };
        assert_eq!(
            protection.stop(0.99, &pushed(99.0, 99.0)),
            None,
            "moments are no forces, and the two do not add up"
        );
        assert_eq!(protection.stop(1.01, &pushed(101.0, 0.0)), Some(StopReason::JointSpeed));
        assert_eq!(protection.stop(0.0, &pushed(101.0, 101.0)), Some(StopReason::HandForce));
        assert_eq!(protection.stop(0.0, &pushed(0.0, 101.0)), Some(StopReason::LinkForce));
        assert_eq!(protection.stop(0.0, &itself), Some(StopReason::SelfContact));
        assert_eq!(Protection { self_contact: false, ..protection }.stop(0.0, &itself), None);
    }

    /// Joint 6 may turn faster than joint 2.
    #[test]
    fn each_joint_counts_by_its_own_limit() {
        let turning = |joint: usize, qd: f64| {
            let mut speeds = JointVector::zeros();
            speeds[joint] = qd;
            speed_share(&speeds, &Arm::PANDA)
        };
        assert_eq!(
            (turning(1, -2.175), turning(5, 1.305), speed_share(&JointVector::zeros(), &Arm::PANDA)),
            (1.0, 0.5, 0.0)
        );
    }

    #[test]
    fn names_in_messages_are_those_in_tables() {
        type Name = serde::de::value::StrDeserializer<'static, serde::de::value::Error>;
        for reason in [StopReason::JointSpeed, StopReason::HandForce, StopReason::LinkForce, StopReason::SelfContact] {
            assert_eq!(StopReason::deserialize(Name::new(reason.as_str())), Ok(reason));
        }
    }
}
