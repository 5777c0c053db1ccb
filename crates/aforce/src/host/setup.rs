//! The whole set-up of a host, as one TOML file.

use nalgebra::Unit;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::arm::Arm;
use crate::error::{ConfigError, positive, within};
use crate::host::interface::ArmInterface;
use crate::host::limits::HostLimits;
use crate::law::action_space::{ActionSpace, DAMPING_RATIO_MAX, SetPoint};
use crate::law::built_in::{RecordError, UnknownActionSpace};
use crate::law::commanded_psi::PsiParameter;
use crate::law::config::ControllerConfig;
use crate::law::controller::Controller;
use crate::law::force::ForceConfig;
use crate::law::goal::GoalRule;
use crate::law::interpolator::Interpolation;
use crate::law::stiffness::Stiffness;
use crate::record::{self, Problem};
use crate::spatial::Vector3;

/// Lever (m) at which the strongest joint must be able to hold `limits.wrench_max`.
const SHORT_LEVER: f64 = 0.25;
/// Largest share of `limits.external_max`, where a force is a fault, that an action may ask for: a controlled force swings about the value
/// asked for.
const PRESS_SHARE: f64 = 0.8;
/// Largest stiffness of a joint's hold (Nm/rad).
const HOLD_STIFFNESS_MAX: f64 = 1000.0;
/// Least damping ratio, of a joint's hold and of a space whose stiffness does not adapt.
const LEAST_RATIO: f64 = 0.3;

/// `controller` and `space` of a set-up whose text leaves them out.
const GENTLE: &str = include_str!("gentle.toml");

/// The set-up of a [`Host`](crate::host::Host).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HostSetup {
    /// n: the direction, in base axes, in which the environment pushes on the tool (+z for a table below).
    pub contact_axis: [f64; 3],
    /// The arm.
    pub arm: Arm,
    /// The conventions of the arm's interface.
    pub interface: ArmInterface,
    /// Bounds between law and arm.
    pub limits: HostLimits,
    /// What all action spaces share. `control_hz` is the arm's nominal rate.
    pub controller: ControllerConfig,
    /// The policy's action space.
    pub space: ActionSpace,
}

/// Why a text is not a set-up.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// The text is not TOML, or a field is missing, unknown or of the wrong type.
    #[error(transparent)]
    Text(#[from] Problem),
    /// The table of the space is not an action space.
    #[error("space: {0}")]
    Space(#[from] RecordError),
    /// The space's name is unknown.
    #[error("space: {0}")]
    SpaceName(#[from] UnknownActionSpace),
    /// Arm, interface or space is neither a known name nor a table.
    #[error("{field} = {value}: known are {known}, or a table that extends one")]
    Name {
        /// The field of the set-up.
        field: &'static str,
        /// The value found.
        value: Value,
        /// The known names.
        known: &'static str,
    },
    /// A value that is not allowed.
    #[error(transparent)]
    Value(#[from] ConfigError),
}

impl HostSetup {
    /// Reads a set-up from TOML. `arm` is `"panda"`, `"fr3"` or a table; `interface` is `"franka"`, `"plain"` or a
    /// table; `space` is the name of a built-in space or a table. A table has every field, or extends a name and
    /// changes some (`{ extends = "plain", .. }`). An arm that extends another must stay within its limits.
    ///
    /// `limits` and `contact_axis` (+z) have defaults. What `controller` leaves out is as in `gentle.toml` (1 kHz,
    /// steps of 2 cm, 30 N), or else as in [`ControllerConfig`]. A `space` that is left out is that of `gentle.toml` (150 to
    /// 1500 N/m).
    ///
    /// ```
    /// use aforce::host::HostSetup;
    /// let text = "arm = 'fr3'\ninterface = 'franka'";
    /// assert_eq!(HostSetup::from_toml(text).unwrap().controller.samples_per_action(), 50);
    /// ```
    ///
    /// # Errors
    /// If a field is missing, unknown, of the wrong type, or not allowed.
    pub fn from_toml(text: &str) -> Result<Self, SetupError> {
        let mut file: Table = record::parse(text)?;
        let mut gentle: Table = record::parse(GENTLE)?;
        let default = gentle.remove("space");
        let space = match file.remove("space").or(default) {
            Some(Value::String(name)) => name.parse()?,
            Some(Value::Table(record)) => {
                let name = record.get("name").and_then(Value::as_str).unwrap_or("space").to_owned();
                ActionSpace::from_table(record, &name)?
            }
            other => {
                let value = other.unwrap_or_else(|| Value::String(String::new()));
                return Err(SetupError::Name { field: "space", value, known: "the built-in spaces" });
            }
        };
        let arms = [("panda", Arm::PANDA), ("fr3", Arm::FR3)];
        let known = file.get("arm").map(|arm| arm.get("extends").unwrap_or(arm)).and_then(Value::as_str);
        let own = arms.iter().find(|(name, _)| known == Some(name)).map(|(_, arm)| *arm);
        named(&mut file, "arm", &arms, "panda, fr3")?;
        let interfaces = [("franka", ArmInterface::FRANKA), ("plain", ArmInterface::PLAIN)];
        named(&mut file, "interface", &interfaces, "franka, plain")?;
        record::overlay(&mut gentle, file);
        let file = gentle;
        let Rest { contact_axis, arm, interface, limits, controller } =
            record::read(file).map_err(|problem| Problem { place: record::place_of(text, &problem.key), ..problem })?;
        let setup = Self { contact_axis, arm, interface, limits, controller, space };
        setup.validate()?;
        if let Some(own) = own {
            setup.arm.stays_within(&own).map_err(|error| error.below("arm"))?;
        }
        Ok(setup)
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first that is not allowed, with its field and its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.arm.validate().map_err(|error| error.below("arm"))?;
        for (joint, rate) in self.arm.torque_rate_max.into_iter().enumerate() {
            positive(&format!("arm.torque_rate_max (joint {})", joint + 1), rate)?;
        }
        self.interface.validate().map_err(|error| error.below("interface"))?;
        self.limits.validate().map_err(|error| error.below("limits"))?;
        self.controller.validate().map_err(|error| error.below("controller"))?;
        self.space.validate(self.controller.control_hz)?;
        if self.space.psi().is_some_and(|psi| !psi.anti_windup) {
            let reason = "false: on an arm K must not wind up while a torque is at its limit".to_owned();
            return Err(ConfigError::Contradiction { field: "space.stiffness.adaptive.anti_windup".into(), reason });
        }
        if self.space.set_point == SetPoint::Jump {
            let reason = "\"jump\": on an arm a set-point moves, \"interpolated\" would be right".to_owned();
            return Err(ConfigError::Contradiction { field: "space.set_point".into(), reason });
        }
        self.damping_fits()?;
        self.rates_fit()?;
        self.limits_fit()?;
        self.forces_fit()?;
        self.steps_fit()?;
        self.contact_axis().map(|_| ())
    }

    /// Refuses a fixed or commanded stiffness with so little damping that the tool would swing. An adaptive one is checked
    /// for stability with its space.
    fn damping_fits(&self) -> Result<(), ConfigError> {
        match &self.space.stiffness {
            Stiffness::Adaptive(_) => Ok(()),
            Stiffness::Fixed(_) | Stiffness::Commanded(_) => {
                self.space.damping_ratio.within("space.damping_ratio", LEAST_RATIO..=DAMPING_RATIO_MAX)
            }
        }
    }

    /// Refuses rates with which every cycle or the time between two actions would be a fault, and a leak mu that would overshoot in the
    /// longest cycle.
    fn rates_fit(&self) -> Result<(), ConfigError> {
        let HostLimits { period_max, silence_max, .. } = self.limits;
        let (period, action) = (self.controller.dt(), 1.0 / f64::from(self.controller.policy_hz));
        let own = self.space.psi().map(|psi| ("space.stiffness.adaptive.mu".to_owned(), psi.mu.vector().max()));
        let commanded = self.space.commanded_psi.iter().flat_map(|commanded| commanded.ranges.iter().enumerate());
        let commanded = commanded.filter(|(_, range)| range.parameter == PsiParameter::Mu);
        let commanded =
            commanded.map(|(at, range)| (format!("space.commanded_psi.ranges[{at}].high"), range.high.vector().max()));
        let contradiction = |field: &str, reason| Err(ConfigError::Contradiction { field: field.into(), reason });
        if period > period_max {
            let reason = format!("a cycle of {period} s is longer than limits.period_max, {period_max} s");
            return contradiction("controller.control_hz", reason);
        }
        if action >= silence_max {
            let reason = format!("an action in {action} s is silence: limits.silence_max is {silence_max} s");
            return contradiction("controller.policy_hz", reason);
        }
        if let Some((field, mu)) = own.into_iter().chain(commanded).find(|(_, mu)| mu * period_max > 1.0) {
            let reason = format!("{mu} 1/s would overshoot in a cycle of limits.period_max, {period_max} s");
            return contradiction(&field, reason);
        }
        Ok(())
    }

    /// Refuses bounds beyond what the arm can do, and a hold that would swing or shake it.
    fn limits_fit(&self) -> Result<(), ConfigError> {
        let HostLimits { joint_margin, wrench_max, hold, .. } = &self.limits;
        let narrowest = self.arm.range.iter().map(|[low, high]| high - low).fold(f64::INFINITY, f64::min);
        within("limits.joint_margin", *joint_margin, 0.0..=0.25 * narrowest)?;
        let strongest = self.arm.torque_max.into_iter().fold(0.0, f64::max);
        // The strongest joint must hold the force at a lever of 25 cm, and the moment. An infinite bound is no bound.
        for (max, allowed) in wrench_max.iter().zip([strongest / SHORT_LEVER, strongest]) {
            if max.is_finite() {
                within("limits.wrench_max", *max, 0.0..=allowed)?;
            }
        }
        for joint in 0..7 {
            let (stiffness, damping, inertia) =
                (hold.stiffness[joint], hold.damping[joint], self.arm.rotor_inertia[joint]);
            let place = |name: &str| format!("limits.hold.{name} (joint {})", joint + 1);
            within(&place("stiffness"), stiffness, 0.0..=HOLD_STIFFNESS_MAX)?;
            // The rotor alone, on the spring of the hold, must have the least damping ratio. A damping above half of inertia/dt would
            // overshoot within a cycle.
            let (least, most) =
                (2.0 * LEAST_RATIO * (stiffness * inertia).sqrt(), 0.5 * inertia / self.controller.dt());
            if inertia > 0.0 {
                within(&place("damping"), damping, least..=most.max(least))?;
            } else if stiffness > 0.0 {
                // The joint's inertia is not known, so no ratio is. Without any damping it would swing whatever its inertia.
                positive(&place("damping"), damping)?;
            }
        }
        Ok(())
    }

    /// Refuses a force that an action may ask for and that would be a fault, and an integral gain with which the force would swing against
    /// a stiff wall. Spaces that command no force are not checked.
    fn forces_fit(&self) -> Result<(), ConfigError> {
        if !self.space.force {
            return Ok(());
        }
        let ForceConfig { force_max, kp, ki, damping_rate_min, .. } = self.controller.force;
        let external_max = self.limits.external_max[0];
        let contradiction = |field: &str, reason| Err(ConfigError::Contradiction { field: field.into(), reason });
        if force_max > PRESS_SHARE * external_max {
            let reason = format!(
                "{force_max} N is above {PRESS_SHARE} of limits.external_max, {external_max} N, where a push is a \
                 fault: lower the one or raise the other"
            );
            return contradiction("controller.force.force_max", reason);
        }
        // Whatever its apparent mass m is, the engaged axis has a damping D of at least m damping_rate_min.
        let swinging = (1.0 + kp) * damping_rate_min;
        if ki > 0.0 && ki >= swinging {
            let reason = format!(
                "{ki} 1/s would swing against a stiff wall: below (1 + kp) damping_rate_min = {swinging} 1/s would be \
                 right"
            );
            return contradiction("controller.force.ki", reason);
        }
        Ok(())
    }

    /// Refuses steps with which a linear ramp would be faster than the arm's tool may be, if three entries are 1 at once. A jerk-limited
    /// set-point keeps the limits by itself.
    fn steps_fit(&self) -> Result<(), ConfigError> {
        let ControllerConfig { policy_hz, position_step, rotation_step, interpolation, .. } = self.controller;
        let Interpolation::Linear { ramp_ratio } = interpolation else { return Ok(()) };
        if matches!(self.space.goal, GoalRule::Absolute { .. }) {
            let reason =
                "linear: an absolute goal may be the whole reach away, \"jerk-limited\" would be right".to_owned();
            return Err(ConfigError::Contradiction { field: "controller.interpolation".into(), reason });
        }
        // Rounded down to four decimals, for a short message.
        let way = |[speed, ..]: [f64; 3]| (1e4 * speed * ramp_ratio / f64::from(policy_hz) / 3f64.sqrt()).floor() / 1e4;
        let [most, turn] = [self.arm.cartesian.translation, self.arm.cartesian.rotation].map(way);
        within("controller.position_step", position_step, 0.0..=most)?;
        within("controller.rotation_step", rotation_step, 0.0..=turn)
    }

    fn contact_axis(&self) -> Result<Unit<Vector3>, ConfigError> {
        contact_axis(self.contact_axis)
    }

    /// A controller for this arm.
    pub(crate) fn new_controller(&self) -> Result<Controller, ConfigError> {
        self.validate()?;
        Controller::new(&self.space, &self.controller, &self.arm, self.contact_axis()?)
    }
}

/// n, a contact axis of any length, as a unit vector.
///
/// # Errors
/// If `n` is zero or nearly so, or has an entry that is not finite or so large that the length overflows.
pub fn contact_axis(n: [f64; 3]) -> Result<Unit<Vector3>, ConfigError> {
    let direction: Option<Unit<Vector3>> = Unit::try_new(n.into(), 1e-9);
    // The norm of large entries overflows, and a division by it gives no unit vector.
    direction.filter(|n| (n.norm() - 1.0).abs() < 1e-6).ok_or_else(|| {
        let reason = format!("{n:?} has no direction");
        ConfigError::Contradiction { field: "contact_axis".into(), reason }
    })
}

/// A set-up without its space.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Rest {
    #[serde(default = "upwards")]
    contact_axis: [f64; 3],
    arm: Arm,
    interface: ArmInterface,
    #[serde(default)]
    limits: HostLimits,
    controller: ControllerConfig,
}

fn upwards() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

/// Replaces the name in `field` by the table that it stands for. Lays a table that `extends` a name over the table of that name.
fn named<T: Serialize>(
    file: &mut Table,
    field: &'static str,
    names: &[(&str, T)],
    known: &'static str,
) -> Result<(), SetupError> {
    let table = match file.remove(field) {
        Some(Value::Table(table)) => table,
        Some(name @ Value::String(_)) => Table::from_iter([("extends".to_owned(), name)]),
        other => {
            file.extend(other.map(|whole| (field.into(), whole)));
            return Ok(());
        }
    };
    let whole = record::extended(table, |value| {
        let named = names.iter().find(|(known, _)| value.as_str() == Some(known));
        let table = named.and_then(|(_, table)| Table::try_from(table).ok());
        table.ok_or(SetupError::Name { field, value, known })
    })?;
    file.insert(field.into(), Value::Table(whole));
    Ok(())
}

#[cfg(test)]
mod tests;
