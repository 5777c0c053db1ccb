//! Explicit force control along the contact axis.

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, not_negative, positive, within};
use crate::law::contact::ContactDetector;
use crate::law::operational_space::OperationalSpace;
use crate::spatial::{Vector3, Vector6, Wrench, linear, rotational, stack};

/// A PID on the measured force, engaged by contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ForceConfig {
    /// Largest force that an action may ask for, and largest commanded force (N): an action entry of -1 to 1 asks for 0 to this. At the top
    /// of the range the controller can therefore correct the command downwards only.
    pub force_max: f64,
    /// Proportional gain (N/N).
    pub kp: f64,
    /// Integral gain (1/s).
    pub ki: f64,
    /// Derivative gain on the measured force (s).
    pub kd: f64,
    /// Bound of the integral term (N).
    pub integral_max: f64,
    /// Largest rate of the command (N/s).
    pub command_rate_max: f64,
    /// Time in which the desired force ramps to a request (s). Every request restarts the ramp, even if the force is unchanged: with
    /// requests at 20 Hz for a constant force, 62 % of the way are done after one action and 86 % after two.
    pub ramp_time: f64,
    /// Contact begins when the force is at least this for `contact_hold` (N).
    pub contact_on: f64,
    /// Contact ends when the force is below this for `contact_hold` (N).
    pub contact_off: f64,
    /// How long the force has to stay past a threshold (s).
    pub contact_hold: f64,
    /// Time in which stiffness and feed-forward fade from the contact axis after contact begins, and return after it ends (s).
    pub engagement_time: f64,
    /// Least damping of the engaged axis (Ns/m). It does more for robustness than any gain.
    pub damping_min: f64,
    /// Least damping of the engaged axis per apparent mass (1/s): against a stiff wall the loop is stable only while
    /// ki < (1 + kp) D/m, so a heavy arm needs more than `damping_min`. 20 is critical damping at 100 1/s^2.
    pub damping_rate_min: f64,
}

impl Default for ForceConfig {
    fn default() -> Self {
        Self {
            force_max: 50.0,
            kp: 0.3,
            ki: 4.0,
            kd: 0.0,
            integral_max: 20.0,
            command_rate_max: 1000.0,
            ramp_time: 0.08,
            contact_on: 4.0,
            contact_off: 1.5,
            contact_hold: 0.010,
            engagement_time: 0.08,
            damping_min: 60.0,
            damping_rate_min: 20.0,
        }
    }
}

impl ForceConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        positive("force.force_max", self.force_max)?;
        not_negative("force.kp", self.kp)?;
        not_negative("force.ki", self.ki)?;
        not_negative("force.kd", self.kd)?;
        not_negative("force.integral_max", self.integral_max)?;
        positive("force.command_rate_max", self.command_rate_max)?;
        positive("force.ramp_time", self.ramp_time)?;
        positive("force.contact_on", self.contact_on)?;
        within("force.contact_off", self.contact_off, f64::MIN_POSITIVE..=self.contact_on)?;
        not_negative("force.contact_hold", self.contact_hold)?;
        positive("force.engagement_time", self.engagement_time)?;
        not_negative("force.damping_min", self.damping_min)?;
        not_negative("force.damping_rate_min", self.damping_rate_min)
    }
}

/// The share of the contact axis that force control has taken from impedance control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceAxis {
    /// n: unit vector, world axes, in which the environment pushes on the tool.
    pub direction: Vector3,
    /// 0: impedance control alone; 1: force control alone.
    pub engagement: f64,
    /// Least damping of the axis when fully engaged (Ns/m).
    pub damping_min: f64,
    /// The same per apparent mass (1/s); the larger of the two counts.
    pub damping_rate_min: f64,
}

impl ForceAxis {
    /// `v` less the engaged share of its linear part along n: (I - engagement n n^T) v.
    #[must_use]
    pub fn release(&self, v: &Vector6) -> Vector6 {
        let along = linear(v).dot(&self.direction) * self.engagement;
        stack(&(linear(v) - along * self.direction), &rotational(v))
    }

    /// The linear part of `wrench` along n.
    pub(crate) fn along(&self, wrench: &Wrench) -> f64 {
        linear(wrench).dot(&self.direction)
    }

    /// `[n; 0]`.
    pub(crate) fn unit(&self) -> Vector6 {
        stack(&self.direction, &Vector3::zeros())
    }

    /// Damping to add along the axis for its least damping (Ns/m), in the engaged share. `damp` turns a velocity into the damping wrench.
    pub(crate) fn missing_damping(&self, lambda: &OperationalSpace, damp: impl Fn(&Vector6) -> Wrench) -> f64 {
        if self.engagement == 0.0 {
            return 0.0;
        }
        let mass = self.direction.dot(&(lambda.lambda_p * self.direction));
        let least = self.damping_min.max(self.damping_rate_min * mass);
        let present = linear(&damp(&self.unit())).dot(&self.direction);
        self.engagement * (least - present).max(0.0)
    }
}

/// The running force controller.
#[derive(Debug, Clone)]
pub struct ForceControl {
    config: ForceConfig,
    direction: Vector3,
    contact: ContactDetector,
    engagement: f64,
    /// Force asked for by the policy, and its ramped version F_d (N).
    target: f64,
    desired: f64,
    /// Rate of the ramp (N/s).
    ramp: f64,
    /// Integral term ki int(F_d - F) (N).
    integral: f64,
    /// Measured force of the previous sample (N, world axes).
    previous: Vector3,
    /// F_cmd (N).
    command: f64,
    /// The part of F_cmd that did not act (N).
    withheld: f64,
}

impl ForceControl {
    /// `direction` is n: the unit vector, in world axes, in which the environment pushes on the tool. `config` is not checked here, but
    /// with the rest of the controller's, by [`ControllerConfig::validate`](crate::ControllerConfig::validate).
    #[must_use]
    pub fn new(config: ForceConfig, direction: Vector3) -> Self {
        let contact = ContactDetector::new(config.contact_on, config.contact_off, config.contact_hold);
        Self {
            config,
            direction,
            contact,
            engagement: 0.0,
            target: 0.0,
            desired: 0.0,
            ramp: 0.0,
            integral: 0.0,
            previous: Vector3::zeros(),
            command: 0.0,
            withheld: 0.0,
        }
    }

    /// Resets to no contact and no command.
    pub fn reset(&mut self) {
        self.contact.reset();
        (self.engagement, self.target, self.desired, self.ramp) = (0.0, 0.0, 0.0, 0.0);
        (self.integral, self.command, self.withheld) = (0.0, 0.0, 0.0);
        self.previous = Vector3::zeros();
    }

    /// Turns n to `direction`, a unit vector in world axes; a reset keeps it. F_d, F_cmd and its integral are numbers along n and turn with
    /// n: along a curved surface the tool is pressed as hard as before, in another direction.
    pub fn set_direction(&mut self, direction: Vector3) {
        self.direction = direction;
    }

    /// The force that the environment should exert along n while in contact (N), at most
    /// `force_max`. Negative numbers and NaN count as 0.
    ///
    /// # Panics
    /// If the configuration's `force_max` is negative or not a number.
    pub fn set_target(&mut self, force: f64) {
        let force = if force.is_nan() { 0.0 } else { force };
        self.target = force.clamp(0.0, self.config.force_max);
        self.ramp = (self.target - self.desired).abs() / self.config.ramp_time;
    }

    /// One sample of `dt` seconds: F_cmd as a wrench (N; world axes), given what the environment exerts on the tool.
    ///
    /// # Panics
    /// If a bound or a rate of the configuration is negative or not a number.
    pub fn update(&mut self, measured: &Wrench, dt: f64) -> Wrench {
        let force = linear(measured).dot(&self.direction);
        let was_in_contact = self.contact.in_contact();
        self.contact.update(force, dt);
        let in_contact = self.contact.in_contact();

        let step = dt / self.config.engagement_time;
        self.engagement = (self.engagement + if in_contact { step } else { -step }).clamp(0.0, 1.0);
        if !in_contact {
            (self.desired, self.integral) = (0.0, 0.0);
            self.move_command(0.0, dt);
        } else {
            if !was_in_contact {
                // F_d begins at the measured force. F_cmd acts in full from here on, while the impedance that brought the tool fades with
                // `engagement`; until it has faded, both push.
                self.desired = force.clamp(0.0, self.target);
                self.ramp = (self.target - self.desired) / self.config.ramp_time;
                self.previous = linear(measured);
            }
            self.pid(force, dt);
        }
        self.previous = linear(measured);
        stack(&(self.direction * self.command), &Vector3::zeros())
    }

    fn pid(&mut self, force: f64, dt: f64) {
        let config = self.config;
        let step = self.ramp * dt;
        self.desired += (self.target - self.desired).clamp(-step, step);
        let error = self.desired - force;
        // F_cmd = F_d + kp (F_d - F) + ki int(F_d - F) - kd dF/dt
        let wanted = self.desired + config.kp * error + self.integral
            - config.kd * (force - self.previous.dot(&self.direction)) / dt;
        self.move_command(wanted, dt);
        // Anti-windup: no integration while the command cannot follow and the error asks for a larger change.
        let cut = wanted - self.command + self.withheld;
        if cut * error <= 0.0 {
            let integral = self.integral + config.ki * error * dt;
            self.integral = integral.clamp(-config.integral_max, config.integral_max);
        }
    }

    /// Records that a bound after this controller cut `force` off the last wrench (N along n); at most F_cmd of it counts. The integral
    /// term then does not grow against the bound, and [`command`](Self::command) returns what is left of F_cmd. The record holds until the
    /// next call.
    pub(crate) fn withhold(&mut self, force: f64) {
        self.withheld = force.clamp(self.command.min(0.0), self.command.max(0.0));
    }

    /// Moves the command towards `wanted` within its bound and its rate.
    fn move_command(&mut self, wanted: f64, dt: f64) {
        let bounded = wanted.clamp(-self.config.force_max, self.config.force_max);
        let step = self.config.command_rate_max * dt;
        self.command += (bounded - self.command).clamp(-step, step);
    }

    /// The force asked for by the policy (N along n), before it is ramped.
    #[must_use]
    pub fn target(&self) -> f64 {
        self.target
    }

    /// F_d (N along n): the ramped target; 0 without contact.
    #[must_use]
    pub fn desired(&self) -> f64 {
        self.desired
    }

    /// F_cmd as it acts (N along n): what the environment should exert; the tool pushes with its opposite.
    #[must_use]
    pub fn command(&self) -> f64 {
        self.command - self.withheld
    }

    /// True between the beginning and the end of contact.
    #[must_use]
    pub fn in_contact(&self) -> bool {
        self.contact.in_contact()
    }

    /// The axis and how far force control has taken it over.
    #[must_use]
    pub fn axis(&self) -> ForceAxis {
        ForceAxis {
            direction: self.direction,
            engagement: self.engagement,
            damping_min: self.config.damping_min,
            damping_rate_min: self.config.damping_rate_min,
        }
    }
}

#[cfg(test)]
mod tests;
