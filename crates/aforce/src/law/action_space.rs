//! Action spaces: how a policy may act. A space is a data record, not a type.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::ConfigError;
use crate::law::commanded_psi::{CommandedPsi, PsiParameter};
use crate::law::config::ControllerConfig;
use crate::law::damping::Damping;
use crate::law::gains::{AXES, Gains};
use crate::law::goal::GoalRule;
use crate::law::psi::Psi;
use crate::law::stability::{StabilityMargin, stability_margin};
use crate::law::stiffness::{Scale, Stiffness, StiffnessUnit};
use crate::name;
use crate::spatial::RotationError;

/// Largest damping ratio of an axis.
pub(crate) const DAMPING_RATIO_MAX: f64 = 10.0;

/// An action space.
///
/// An action lies in [-1, 1] and reads `[kp (6, or 1 if shared) if commanded] [psi (2 per parameter) if commanded] [delta position (3),
/// delta rotation (3)] [normal force (1) if force]`; [`entries`](Self::entries) describes each entry. The built-in spaces are in
/// `spaces.toml` beside this crate's manifest, and parse from their names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActionSpace {
    /// Name of the space in tables and folders.
    pub name: String,
    /// What the pose delta of an action is added to.
    pub goal: GoalRule,
    /// How the set-point reaches the goal.
    pub set_point: SetPoint,
    /// What the tool's velocity is compared with to make e_dot.
    pub rate: RateRule,
    /// How an orientation error is measured.
    pub rotation_error: RotationError,
    /// What a stiffness number means.
    pub unit: StiffnessUnit,
    /// How damping follows stiffness.
    pub damping: Damping,
    /// Damping ratio zeta of each axis; 1 is critical.
    pub damping_ratio: Gains,
    /// Whether the policy commands a force along the contact axis.
    pub force: bool,
    /// Where the stiffness comes from.
    pub stiffness: Stiffness,
    /// Parameters of the adaptive law that the policy commands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub commanded_psi: Option<CommandedPsi>,
}

/// How the set-point reaches the goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SetPoint {
    /// As the controller's configuration says: a ramp, or a jerk-limited move.
    Interpolated,
    /// The set-point is the goal from the first sample on (robosuite's default).
    Jump,
}

/// How e_dot is formed from the tool's velocity x_dot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RateRule {
    /// e_dot = x_dot: damped against standstill (robosuite).
    Standstill,
    /// e_dot = x_dot - x_d_dot. Meant for jerk-limited set-points: with a linear ramp x_d_dot steps at every action, and the damper answers
    /// with torque peaks (forty times the energy with random actions).
    SetPoint,
}

/// One entry of an action.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ActionEntry {
    /// Name of the entry.
    pub name: &'static str,
    /// Unit of `low` and `high`.
    pub unit: &'static str,
    /// Axes in which the entry is expressed.
    pub frame: &'static str,
    /// The value that an entry of -1 means.
    pub low: f64,
    /// The value that an entry of +1 means.
    pub high: f64,
}

impl ActionSpace {
    /// Length of an action.
    #[must_use]
    pub fn dim(&self) -> usize {
        let psi = self.commanded_psi.as_ref().map_or(0, CommandedPsi::dim);
        self.commanded_stiffness() + psi + 6 + usize::from(self.force)
    }

    /// Entries of an action that command stiffness.
    pub(crate) fn commanded_stiffness(&self) -> usize {
        if let Stiffness::Commanded(range) = &self.stiffness { range.entries() } else { 0 }
    }

    /// How far an action entry of 1 moves the goal along (m) or about (rad) an axis, of 0 to 5.
    #[must_use]
    pub fn step(&self, config: &ControllerConfig, axis: usize) -> f64 {
        let configured = if axis < 3 { config.position_step } else { config.rotation_step };
        self.goal.reach(axis).unwrap_or(configured)
    }

    /// Parameters of the adaptive law, if the stiffness adapts.
    #[must_use]
    pub fn psi(&self) -> Option<&Psi> {
        if let Stiffness::Adaptive(psi) = &self.stiffness { Some(psi) } else { None }
    }

    /// The record as a TOML document, which reads back as the same space.
    ///
    /// # Panics
    /// Never: every record is a table.
    #[must_use]
    #[expect(clippy::expect_used, reason = "not on the control loop")]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a record is a table")
    }

    /// What each entry of an action means under `config`, in order.
    #[must_use]
    pub fn entries(&self, config: &ControllerConfig) -> Vec<ActionEntry> {
        const STIFFNESS: [&str; 6] = ["kp_x", "kp_y", "kp_z", "kp_rx", "kp_ry", "kp_rz"];
        const DELTA: [&str; 6] = ["delta_x", "delta_y", "delta_z", "delta_rx", "delta_ry", "delta_rz"];
        const WORLD: &str = "world axes, at the tool point";
        let mut entries = Vec::with_capacity(self.dim());
        if let Stiffness::Commanded(range) = &self.stiffness {
            const ALL: &str = "all axes; unit and range of the translational ones";
            let (names, frame) = if range.shared { (&["kp"][..], ALL) } else { (&STIFFNESS[..], WORLD) };
            for (axis, &name) in names.iter().enumerate() {
                let (low, high) = (range.low[axis], range.high[axis]);
                let unit = match range.scale {
                    Scale::Linear => self.unit.name(axis),
                    Scale::Log => PsiParameter::KMin.unit(self.unit, axis / 3),
                };
                entries.push(ActionEntry { name, unit, frame, low, high });
            }
        }
        for range in self.commanded_psi.iter().flat_map(|psi| &psi.ranges) {
            for (group, frame) in ["translational axes", "rotational axes"].into_iter().enumerate() {
                let (name, unit) = (range.parameter.entry(group), range.parameter.unit(self.unit, group));
                let (low, high) = (range.low[3 * group], range.high[3 * group]);
                entries.push(ActionEntry { name, unit, frame, low, high });
            }
        }
        for (axis, name) in DELTA.into_iter().enumerate() {
            let (unit, step) = (if axis < 3 { "m" } else { "rad" }, self.step(config, axis));
            entries.push(ActionEntry { name, unit, frame: WORLD, low: -step, high: step });
        }
        if self.force {
            let frame = "along the task's contact axis, environment on tool";
            let high = config.force.force_max;
            entries.push(ActionEntry { name: "normal_force", unit: "N", frame, low: 0.0, high });
        }
        entries
    }

    /// The stability margin of each axis at the lowest stiffness; `None` if the stiffness does not adapt.
    #[must_use]
    pub fn margins(&self) -> Option<[StabilityMargin; 6]> {
        self.psi().map(|psi| std::array::from_fn(|axis| self.margin(psi, axis)))
    }

    fn margin(&self, psi: &Psi, axis: usize) -> StabilityMargin {
        let inertia = self.unit.inertia(psi.inertia.vector())[axis];
        let damping = self.damping.of_axis(psi.k_min[axis], inertia, self.damping_ratio[axis]);
        stability_margin(psi, axis, inertia, damping)
    }

    /// Checks every value, and the stability of the adaptive law at its lowest stiffness.
    ///
    /// # Errors
    /// The first value that is not allowed, with its field (below `space`) and its range.
    pub fn validate(&self, control_hz: u32) -> Result<(), ConfigError> {
        self.check(control_hz).map_err(|error| error.below("space"))
    }

    fn check(&self, control_hz: u32) -> Result<(), ConfigError> {
        let contradiction =
            |field: &str, reason: &str| Err(ConfigError::Contradiction { field: field.into(), reason: reason.into() });
        name::check(&self.name).or_else(|reason| contradiction("name", &reason))?;
        self.goal.validate()?;
        self.damping_ratio.within("damping_ratio", 0.0..=DAMPING_RATIO_MAX)?;
        self.stiffness.validate(control_hz)?;
        if self.set_point == SetPoint::Jump && self.rate == RateRule::SetPoint {
            return contradiction(
                "rate",
                "\"set-point\" needs a set-point with a velocity: set_point = \"jump\" has none",
            );
        }
        match (self.psi(), &self.commanded_psi) {
            (Some(psi), None) => self.check_stability(psi),
            (Some(psi), Some(commanded)) => commanded.validate(psi, |psi| {
                psi.validate(control_hz)?;
                self.check_stability(psi)
            }),
            (None, Some(_)) => contradiction("commanded_psi", "needs a stiffness that adapts: stiffness.adaptive"),
            (None, None) => Ok(()),
        }
    }

    /// Refuses parameters under which small oscillations grow, unless `allow_unstable` is set.
    fn check_stability(&self, psi: &Psi) -> Result<(), ConfigError> {
        if psi.allow_unstable {
            return Ok(());
        }
        for (axis, axis_name) in AXES.iter().enumerate() {
            let margin = self.margin(psi, axis);
            if margin.is_stable() {
                continue;
            }
            if margin.damping == 0.0 {
                return Err(ConfigError::Contradiction {
                    field: format!("damping_ratio (axis {axis_name})"),
                    reason: "0: without damping oscillations do not die out; take one above 0, or set \
                             stiffness.adaptive.allow_unstable = true"
                        .into(),
                });
            }
            return Err(ConfigError::Unstable {
                field: format!("stiffness.adaptive.alpha (axis {axis_name})"),
                alpha: margin.alpha,
                alpha_max: margin.alpha_max,
                stiffness: psi.k_min[axis],
                inertia: self.unit.inertia(psi.inertia.vector())[axis],
                damping: margin.damping,
            });
        }
        Ok(())
    }
}

impl fmt::Display for ActionSpace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::psi::DeltaSign;
    use crate::law::stiffness::StiffnessRange;

    fn space(name: &str) -> ActionSpace {
        name.parse().unwrap()
    }

    #[test]
    fn dimensions_and_entries_agree() {
        let config = ControllerConfig::default();
        for space in ActionSpace::built_in() {
            assert_eq!(space.entries(&config).len(), space.dim(), "{space}");
        }
        let dims = ["osc", "osc-force", "variable", "variable-force", "aforce-psi", "aforce"].map(|n| space(n).dim());
        assert_eq!(dims, [6, 7, 12, 13, 10, 6]);
        let described = space("variable-force").entries(&config);
        assert_eq!(
            (described[0].name, described[0].unit, described[0].low, described[0].high),
            ("kp_x", "1/s^2", 0.0, 300.0)
        );
        assert_eq!((described[6].name, described[6].unit, described[6].low), ("delta_x", "m", -0.05));
        assert_eq!((described[12].name, described[12].unit, described[12].high), ("normal_force", "N", 50.0));
        let psi = space("aforce-psi").entries(&config);
        assert_eq!((psi[1].name, psi[1].low), ("tolerance_rotation", 0.09));
        assert_eq!((psi[2].name, psi[2].high), ("k_min_translation", 900.0));
    }

    fn error(change: impl FnOnce(&mut ActionSpace)) -> String {
        let mut space = space("aforce-psi");
        change(&mut space);
        space.validate(500).unwrap_err().to_string()
    }

    fn psi_of(space: &mut ActionSpace) -> &mut Psi {
        match &mut space.stiffness {
            Stiffness::Adaptive(psi) => psi,
            _ => panic!("adapts"),
        }
    }

    #[test]
    fn what_is_not_allowed_is_told_with_field_value_and_range() {
        assert_eq!(
            error(|s| psi_of(s).k_0 = Gains::pair(100.0, 30.0)),
            "space.stiffness.adaptive.k_0 (axis x) = 100 is not allowed; allowed: k_min = 300 or above"
        );
        assert_eq!(
            error(|s| psi_of(s).alpha = Gains::pair(f64::NAN, 1.0)),
            "space.stiffness.adaptive.alpha (axis x) = NaN is not allowed; allowed: 0 or above"
        );
        assert!(error(|s| psi_of(s).k_rate_max = Gains::all(1.0)).contains("gamma = 2700 or above"));
        assert_eq!(
            error(|s| psi_of(s).k_rate_max = Gains::all(f64::INFINITY)),
            "space.stiffness.adaptive.k_rate_max (axis x) = inf is not allowed; allowed: 0 or above, and finite"
        );
        assert!(
            error(|s| psi_of(s).mu = Gains::all(1e4))
                .contains("stiffness.adaptive.mu (axis x) = 10000 is not allowed; allowed: 0 to 500")
        );
        let too_stiff = |s: &mut ActionSpace, stiffness| (s.stiffness, s.commanded_psi) = (stiffness, None);
        let range = StiffnessRange { low: Gains::all(0.0), high: Gains::all(1e6), scale: Scale::Linear, shared: false };
        for message in [
            error(|s| psi_of(s).k_max = Gains::all(1e6)),
            error(|s| too_stiff(s, Stiffness::Fixed(Gains::all(1e6)))),
            error(|s| too_stiff(s, Stiffness::Commanded(range))),
        ] {
            assert!(message.contains("(axis x) = 1000000 is not allowed; allowed: 0 to 100000"), "{message}");
        }
        assert!(error(|s| s.damping_ratio = Gains::all(-1.0)).contains("damping_ratio (axis x) = -1"));
        assert!(error(|s| s.stiffness = Stiffness::Fixed(Gains::all(1.0))).contains("commanded_psi"));
        assert!(error(|s| (s.set_point, s.rate) = (SetPoint::Jump, RateRule::SetPoint)).contains("space.rate"));
        assert!(error(|s| s.name = "a/b".into()).contains("space.name"));
        assert!(error(|s| s.name = "1e3".into()).contains("reads as a number"));
        let unstable = error(|s| psi_of(s).alpha = Gains::pair(5000.0, 1.0));
        assert!(unstable.contains("(axis x)") && unstable.contains("= 5000 is unstable"), "{unstable}");
        let undamped = error(|s| {
            s.damping_ratio = Gains::pair(0.0, 1.0);
            psi_of(s).alpha = Gains::all(0.0);
        });
        assert!(undamped.starts_with("space.damping_ratio (axis x): 0: without damping"), "{undamped}");
        let mu = error(|s| {
            psi_of(s).delta_sign = DeltaSign::Literal;
            s.commanded_psi.as_mut().unwrap().ranges[0].parameter = PsiParameter::Mu;
        });
        assert!(mu.starts_with("space.commanded_psi.ranges[0]: mu, with delta_sign"), "{mu}");
        let uneven = error(|s| s.commanded_psi.as_mut().unwrap().ranges[1].low.set(2, 50.0));
        assert!(uneven.starts_with("space.commanded_psi.ranges[1].low: one entry commands three axes"), "{uneven}");
    }

    /// The limit is checked at the corners of what the policy may command, not at the record's own psi.
    #[test]
    fn a_commanded_law_is_stable_wherever_the_policy_takes_it() {
        let stable_until = |k_min: f64| {
            let mut space = space("aforce");
            psi_of(&mut space).k_min = Gains::pair(k_min, 20.0);
            psi_of(&mut space).k_0 = Gains::pair(500.0, 30.0);
            space.margins().unwrap()[0].alpha_max
        };
        let alpha = 0.5 * (stable_until(100.0) + stable_until(300.0));
        let mut plain = space("aforce");
        psi_of(&mut plain).alpha = Gains::pair(alpha, 5.0);
        plain.validate(500).unwrap();
        let refused = error(|space| psi_of(space).alpha = Gains::pair(alpha, 5.0));
        assert!(refused.contains("k_min = 100"), "{refused}");
        let crossed = error(|space| space.commanded_psi.as_mut().unwrap().ranges[1].high = Gains::all(5000.0));
        assert!(crossed.contains("k_max"), "{crossed}");
        let twice = error(|space| {
            let ranges = &mut space.commanded_psi.as_mut().unwrap().ranges;
            ranges.push(ranges[0].clone());
        });
        assert!(twice.contains("twice"), "{twice}");
    }
}
