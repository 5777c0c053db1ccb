//! The controller: one action to one goal, one measurement to one torque.

use nalgebra::UnitVector3;

use crate::action::decode;
use crate::action_space::{ActionSpace, RateRule, SetPoint};
use crate::adaptation::AdaptiveLaw;
use crate::arm::{Arm, CartesianLimits};
use crate::config::ControllerConfig;
use crate::error::ConfigError;
use crate::force::ForceControl;
use crate::guard::{Active, Guard, Sample, Unguarded};
use crate::impedance::{Impedance, impedance};
use crate::interpolator::Interpolator;
use crate::limits::{TorqueLimiter, TorqueLimits};
use crate::null_space::null_space_torque;
use crate::operational_space::OperationalSpace;
use crate::psi::Psi;
use crate::spatial::{JointVector, Measurement, Pose, Twist, Vector6, Wrench, all_finite};
use crate::stiffness::Stiffness;

/// Turns the actions of one [`ActionSpace`] into joint torques.
#[derive(Debug, Clone)]
pub struct Controller {
    space: ActionSpace,
    config: ControllerConfig,
    dt: f64,
    // The parts that run.
    set_point: Interpolator,
    law: Option<AdaptiveLaw>,
    force: ForceControl,
    limiter: TorqueLimiter,
    // State of the episode.
    start: Pose,
    goal: Pose,
    q0: JointVector,
    /// Actions since the start, as far as psi is commanded.
    actions: u32,
    error: Vector6,
    /// K in the space's unit.
    stiffness: Vector6,
    // Of the latest sample, as it acts (N, Nm; W): F_ff, spring and damper, all of the task's wrench, its power.
    feedforward: Wrench,
    impedance: Impedance,
    wrench: Wrench,
    power: [f64; 2],
    /// diag(Lambda) of the latest sample.
    inertia: Vector6,
}

impl Controller {
    /// A controller for `space`. `contact_axis` is n: the direction, in world axes, in which the environment pushes on
    /// the tool (+z for a table below); only spaces with force use it. Interpolated set-points move no faster than the Panda
    /// may; those of another arm are bounded by a [`Host`](crate::host::Host). Call [`reset`](Self::reset) before use.
    ///
    /// # Errors
    /// If a value of `space` or `config` is not allowed, or the adaptive law is unstable.
    pub fn new(
        space: &ActionSpace,
        config: &ControllerConfig,
        limits: TorqueLimits,
        contact_axis: UnitVector3<f64>,
    ) -> Result<Self, ConfigError> {
        Self::of_arm(space, config, limits, &Arm::PANDA.cartesian, contact_axis)
    }

    /// The same, for an arm whose tool may move as `cartesian` says.
    pub(crate) fn of_arm(
        space: &ActionSpace,
        config: &ControllerConfig,
        limits: TorqueLimits,
        cartesian: &CartesianLimits,
        contact_axis: UnitVector3<f64>,
    ) -> Result<Self, ConfigError> {
        config.validate()?;
        space.validate(config.control_hz)?;
        Ok(Self {
            space: space.clone(),
            config: *config,
            dt: config.dt(),
            set_point: match space.set_point {
                SetPoint::Interpolated => {
                    Interpolator::new(&config.interpolation, cartesian, config.samples_per_action(), config.dt())
                }
                SetPoint::Jump => Interpolator::jump(config.dt()),
            },
            law: None,
            force: ForceControl::new(config.force, contact_axis.into_inner()),
            limiter: TorqueLimiter::new(limits),
            start: Pose::identity(),
            goal: Pose::identity(),
            q0: JointVector::zeros(),
            actions: 0,
            error: Vector6::zeros(),
            stiffness: Vector6::zeros(),
            feedforward: Wrench::zeros(),
            impedance: Impedance { elastic: Wrench::zeros(), viscous: Wrench::zeros() },
            wrench: Wrench::zeros(),
            power: [0.0; 2],
            inertia: Vector6::repeat(1.0),
        })
    }

    /// Begins an episode: goal and set-point at the measured pose, the present posture to keep, K(0), no force.
    pub fn reset(&mut self, y: &Measurement) {
        (self.start, self.goal) = (y.pose, y.pose);
        self.q0 = y.q;
        self.set_point.reset(&y.pose);
        self.law = self.space.psi().map(|psi| AdaptiveLaw::new(*psi));
        self.force.reset();
        self.limiter.reset(&y.bias);
        self.actions = 0;
        self.error = Vector6::zeros();
        self.stiffness = self.space.stiffness.at_reset();
        self.feedforward = Wrench::zeros();
        self.impedance = Impedance { elastic: Wrench::zeros(), viscous: Wrench::zeros() };
        (self.wrench, self.power) = (Wrench::zeros(), [0.0; 2]);
        self.inertia = OperationalSpace::new(&y.mass, &y.jacobian).map_or(Vector6::repeat(1.0), |arm| arm.diagonal());
    }

    /// One policy action, entries in [-1, 1] (others are clipped): a new goal, counted from its origin; stiffness, psi and
    /// force, if commanded, take effect at once.
    ///
    /// # Panics
    /// If `action` has not the length [`ActionSpace::dim`].
    pub fn set_goal(&mut self, action: &[f64], y: &Measurement) {
        self.set_guarded_goal(action, y, &mut Unguarded);
    }

    /// The same under a guard; false if no move to the goal can be planned, which is then not taken.
    pub(crate) fn set_guarded_goal(&mut self, action: &[f64], y: &Measurement, guard: &mut impl Guard) -> bool {
        let command = decode(&self.space, &self.config, action);
        if let Some(stiffness) = command.stiffness {
            self.stiffness = stiffness;
        }
        if let Some(force) = command.force {
            self.force.set_target(force);
        }
        if let (Some(commanded), Some(psi), Some(law)) = (&self.space.commanded_psi, self.space.psi(), &mut self.law) {
            if self.actions.is_multiple_of(commanded.hold) {
                let mut psi = *psi;
                commanded.apply(command.psi, &mut psi);
                *law.psi_mut() = psi;
            }
            self.actions += 1;
        }
        let goal = guard.goal(self.space.goal.next_goal(&self.start, &self.goal, &y.pose, &command.delta));
        // A diverged plant must not poison the goal; `update` counts the fault.
        let readable = all_finite(&goal.translation.vector) && all_finite(&goal.rotation.coords);
        let planned = readable && self.set_point.set_goal(&goal);
        if planned {
            self.goal = goal;
        }
        planned
    }

    /// Other parameters for the adaptive law, from the next sample on. K moves to new bounds at `k_rate_max`; K(0) counts from
    /// the next reset. What a policy chose of psi ([`ActionSpace::commanded_psi`]) is given up until it chooses again.
    ///
    /// # Errors
    /// If a value is not allowed, the law would be unstable, or the space's stiffness does not adapt. Nothing changes then.
    pub fn set_psi(&mut self, psi: &Psi) -> Result<(), ConfigError> {
        if self.space.psi().is_none() {
            let reason = format!("the stiffness of `{}` does not adapt", self.space);
            return Err(ConfigError::Contradiction { field: "psi".into(), reason });
        }
        let space = ActionSpace { stiffness: Stiffness::Adaptive(*psi), ..self.space.clone() };
        space.validate(self.config.control_hz)?;
        self.space = space;
        if let Some(law) = &mut self.law {
            *law.psi_mut() = *psi;
        }
        Ok(())
    }

    /// One control sample: tau = J^T (-F_ff - F_d - K e - D e_dot) + bias + null space (Nm), limited. With stiffness in 1/s^2
    /// F_ff, K e and D e_dot are multiplied by Lambda; for F_d stands F_cmd, with which force control holds it.
    pub fn update(&mut self, y: &Measurement) -> JointVector {
        let tau = self.torque(y, self.dt, &mut Unguarded);
        // Of a sample that cannot be read K, F_ff and F_d stay as they were; gravity compensation holds the arm if it can.
        self.limiter.pass(&tau, &y.bias, self.dt)
    }

    /// The torque of a sample `dt` seconds after the last (Nm), before the limits of the joints; NaN if the sample cannot be
    /// read.
    pub(crate) fn torque(&mut self, y: &Measurement, dt: f64, guard: &mut impl Guard) -> JointVector {
        // Set-point x_d, and how far the force controller owns the contact axis.
        let (x_d, xd_dot) = self.set_point.step(dt);
        let axis = self.force.axis();

        // Error e = x - x_d and its rate. Along the contact axis, while engaged, the set-point does not move.
        let error = self.space.rotation_error.of(&y.pose, &x_d);
        let e_dot = y.twist
            - match self.space.rate {
                RateRule::SetPoint => axis.release(&xd_dot),
                RateRule::Standstill => Twist::zeros(),
            };
        let joints = all_finite(&y.q) && all_finite(&y.qd) && all_finite(&y.bias);
        let readable = joints && all_finite(&error) && all_finite(&e_dot) && all_finite(&y.wrench);
        let Some(arm) = OperationalSpace::new(&y.mass, &y.jacobian).filter(|_| readable) else {
            return JointVector::repeat(f64::NAN);
        };
        self.error = error;
        let e = guard.error(error);
        let sample = Sample { y, arm: &arm, unit: self.space.unit, axis: &axis, e, dt };

        // K and F_ff (eqs. 4-6), from the errors that are not force control's.
        let mut wanted = Active { stiffness: self.stiffness, feedforward: Vector6::zeros(), force: Wrench::zeros() };
        if let Some(law) = &mut self.law {
            let e = axis.release(&e);
            let excess = guard.excess(y.jacobian * self.limiter.excess(), &e);
            law.update(&e, &axis.release(&e_dot), &excess, dt);
            (wanted.stiffness, wanted.feedforward) = (*law.stiffness(), *law.feedforward());
        }

        // F_cmd in place of F_d.
        if self.space.force {
            wanted.force = self.force.update(&y.wrench, dt);
        }

        let Active { stiffness, feedforward: f_ff, force: f_cmd } = guard.active(wanted, &sample);
        if let Some(law) = &mut self.law {
            law.set_stiffness(&stiffness);
            self.stiffness = stiffness;
            self.feedforward = self.space.unit.to_wrench(&axis.release(&f_ff), &arm);
        }

        // Wrench -F_ff - K e - D e_dot - F_cmd.
        self.impedance = impedance(&self.space, &arm, &axis, &e, &e_dot, &stiffness, &f_ff);
        let wrench = -self.impedance.elastic - self.impedance.viscous - f_cmd;
        self.wrench = guard.wrench(wrench, &self.impedance.viscous, &sample);
        self.force.withhold(axis.along(&(wanted.force - f_cmd)) + axis.along(&(self.wrench - wrench)));
        self.power = [0, 3].map(|at| self.wrench.fixed_rows::<3>(at).dot(&y.twist.fixed_rows::<3>(at)));
        self.inertia = arm.diagonal();

        // Joint torques; the limits follow.
        let null_space = null_space_torque(y, &arm, &self.q0, self.config.null_space_stiffness);
        guard.torque(y.jacobian.tr_mul(&self.wrench) + y.bias + null_space, y)
    }

    /// The last step before a torque leaves.
    pub(crate) fn limiter(&mut self) -> &mut TorqueLimiter {
        &mut self.limiter
    }
}

mod readings;
#[cfg(test)]
mod tests;
