//! What sets one seven-joint arm apart from another, as data: ranges, limits, rotors.

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, not_negative, positive, within};
use crate::law::limits::TorqueLimits;

/// Velocity, acceleration and jerk that an arm's maker allows its tool.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CartesianLimits {
    /// Velocity (m/s), acceleration (m/s^2) and jerk (m/s^3) of the tool point.
    pub translation: [f64; 3],
    /// The same of the tool's rotation (rad/s, rad/s^2, rad/s^3).
    pub rotation: [f64; 3],
}

/// An arm of seven joints.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arm {
    /// Lower and upper end of the range of each joint (rad).
    pub range: [[f64; 2]; 7],
    /// Largest speed of each joint, either way (rad/s).
    pub speed_max: [f64; 7],
    /// Largest torque of each joint, either way (Nm).
    pub torque_max: [f64; 7],
    /// Largest rate of each joint's torque, either way (Nm/s); infinite where a simulated arm has no such limit.
    pub torque_rate_max: [f64; 7],
    /// Rotor inertia reflected to each joint (kg m^2).
    pub rotor_inertia: [f64; 7],
    /// Limits of the tool's motion. [Jerk-limited](crate::Interpolation::JerkLimited) set-points use a share of them.
    pub cartesian: CartesianLimits,
}

/// Rotor inertia at each joint of the FR3 (kg m^2), from the notes of Drake's model. The Panda has the same drives.
const ROTORS: [f64; 7] = [0.606, 0.606, 0.462, 0.462, 0.206, 0.206, 0.206];

impl Arm {
    /// Motor constant times gear ratio of the joints of a Panda and of an FR3 (Nm/sqrt(W)), for an [`EnergyLedger`](crate::EnergyLedger).
    /// The two values are estimates for frameless motors of this size behind 100:1 gears, one for the first four joints and one for the
    /// last three; no published figures exist. Use copper losses for ratios, not for values.
    pub const FRANKA_DRIVES: [f64; 7] = {
        const LARGE: f64 = 0.10 * 100.0;
        const SMALL: f64 = 0.04 * 100.0;
        [LARGE, LARGE, LARGE, LARGE, SMALL, SMALL, SMALL]
    };

    /// Franka Emika Panda, from Franka's control-interface documentation.
    pub const PANDA: Self = Self {
        range: [
            [-2.8973, 2.8973],
            [-1.7628, 1.7628],
            [-2.8973, 2.8973],
            [-3.0718, -0.0698],
            [-2.8973, 2.8973],
            [-0.0175, 3.7525],
            [-2.8973, 2.8973],
        ],
        speed_max: [2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61],
        torque_max: [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
        torque_rate_max: [1000.0; 7],
        rotor_inertia: ROTORS,
        cartesian: CartesianLimits { translation: [1.7, 13.0, 6500.0], rotation: [2.5, 25.0, 12_500.0] },
    };

    /// Franka Research 3, from the same source; range as in franka_description (`robots/fr3/joint_limits.yaml`, 2025).
    pub const FR3: Self = Self {
        range: [
            [-2.7437, 2.7437],
            [-1.7837, 1.7837],
            [-2.9007, 2.9007],
            [-3.0421, -0.1518],
            [-2.8065, 2.8065],
            [0.5445, 4.5169],
            [-3.0159, 3.0159],
        ],
        speed_max: [2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26],
        cartesian: CartesianLimits { translation: [3.0, 9.0, 4500.0], rotation: [2.5, 17.0, 8500.0] },
        ..Self::PANDA
    };

    /// Largest torques and torque rates of the joints.
    ///
    /// # Errors
    /// If a limit is NaN or negative.
    pub(crate) fn torque_limits(&self) -> Result<TorqueLimits, ConfigError> {
        TorqueLimits::new(self.torque_max.into(), self.torque_rate_max.into())
    }

    /// Checks that ranges, speeds, torques, torque rates and tool limits lie within those of `other`. Rotor inertia is
    /// not compared.
    ///
    /// # Errors
    /// The first value beyond that of `other`, with its field.
    pub fn stays_within(&self, other: &Self) -> Result<(), ConfigError> {
        for (joint, ([low, high], [least, most])) in self.range.into_iter().zip(other.range).enumerate() {
            within(&format!("range (joint {}, lower end)", joint + 1), low, least..=most)?;
            within(&format!("range (joint {}, upper end)", joint + 1), high, least..=most)?;
        }
        for (name, values, most) in [
            ("speed_max", self.speed_max, other.speed_max),
            ("torque_max", self.torque_max, other.torque_max),
            ("torque_rate_max", self.torque_rate_max, other.torque_rate_max),
        ] {
            for (joint, (value, most)) in values.into_iter().zip(most).enumerate() {
                within(&format!("{name} (joint {})", joint + 1), value, 0.0..=most)?;
            }
        }
        let cartesian = [
            ("cartesian.translation", self.cartesian.translation, other.cartesian.translation),
            ("cartesian.rotation", self.cartesian.rotation, other.cartesian.rotation),
        ];
        for (name, values, most) in cartesian {
            for (value, most) in values.into_iter().zip(most) {
                within(name, value, 0.0..=most)?;
            }
        }
        Ok(())
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is not allowed, with its field and its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        for (joint, [low, high]) in self.range.into_iter().enumerate() {
            within(&format!("range (joint {}, lower end)", joint + 1), low, -100.0..=100.0)?;
            within(&format!("range (joint {}, upper end)", joint + 1), high, low..=100.0)?;
        }
        for (name, values) in [("speed_max", self.speed_max), ("torque_max", self.torque_max)] {
            for (joint, value) in values.into_iter().enumerate() {
                positive(&format!("{name} (joint {})", joint + 1), value)?;
            }
        }
        for (joint, value) in self.torque_rate_max.into_iter().enumerate() {
            within(&format!("torque_rate_max (joint {})", joint + 1), value, f64::MIN_POSITIVE..=f64::INFINITY)?;
        }
        for (joint, value) in self.rotor_inertia.into_iter().enumerate() {
            not_negative(&format!("rotor_inertia (joint {})", joint + 1), value)?;
        }
        for value in self.cartesian.translation {
            positive("cartesian.translation", value)?;
        }
        for value in self.cartesian.rotation {
            positive("cartesian.rotation", value)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arms_are_valid_and_survive_a_file() {
        for arm in [Arm::PANDA, Arm::FR3] {
            arm.validate().unwrap();
            assert_eq!(toml::from_str::<Arm>(&toml::to_string(&arm).unwrap()).unwrap(), arm);
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_its_joint() {
        let mut arm = Arm::PANDA;
        arm.range[3] = [1.0, -1.0];
        let text = arm.validate().unwrap_err().to_string();
        assert_eq!(text, "range (joint 4, upper end) = -1 is not allowed; allowed: 1 to 100");
        let arm = Arm { torque_max: [f64::NAN; 7], ..Arm::FR3 };
        assert!(arm.validate().unwrap_err().to_string().starts_with("torque_max (joint 1) = NaN"));
        let arm = Arm { speed_max: [f64::INFINITY; 7], ..Arm::FR3 };
        assert!(
            arm.validate().unwrap_err().to_string().ends_with("= inf is not allowed; allowed: above 0, and finite")
        );
        // In simulation a torque may jump.
        Arm { torque_rate_max: [f64::INFINITY; 7], ..Arm::FR3 }.validate().unwrap();
    }
}
