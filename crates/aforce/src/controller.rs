//! The controller: one action to one goal, one measurement to one torque.

use nalgebra::UnitVector3;

use crate::action::decode;
use crate::action_space::{ActionSpace, Impedance};
use crate::adaptation::AdaptiveLaw;
use crate::config::ControllerConfig;
use crate::error::ConfigError;
use crate::force::ForceControl;
use crate::impedance::{ImpedanceForm, impedance_wrench};
use crate::interpolator::Interpolator;
use crate::limits::{TorqueExit, TorqueLimits};
use crate::null_space::null_space_torque;
use crate::operational_space::OperationalSpace;
use crate::spatial::{JointVector, Measurement, Pose, Twist, Vector6, Wrench, all_finite, pose_error};

/// Turns the actions of one [`ActionSpace`] into joint torques.
#[derive(Debug, Clone)]
pub struct Controller {
    space: ActionSpace,
    config: ControllerConfig,
    form: ImpedanceForm,
    dt: f64,
    // The parts that run.
    interpolator: Interpolator,
    law: Option<AdaptiveLaw>,
    force: ForceControl,
    exit: TorqueExit,
    // State of the episode.
    goal: Pose,
    q0: JointVector,
    error: Vector6,
    /// K in the units of the form's convention.
    stiffness: Vector6,
    /// F_ff as the wrench that acts (N, Nm).
    feedforward: Wrench,
    /// diag(Lambda) of the latest sample.
    inertia: Vector6,
}

impl Controller {
    /// A controller for `space`. `contact_axis` is n: the direction, in world axes, in which the environment pushes on
    /// the tool (+z for a table below); only spaces with force use it. Call [`reset`](Self::reset) before use.
    ///
    /// # Errors
    /// If a value of `config` is not allowed, or the adaptive law in use is unstable.
    pub fn new(
        space: ActionSpace,
        config: &ControllerConfig,
        limits: TorqueLimits,
        contact_axis: UnitVector3<f64>,
    ) -> Result<Self, ConfigError> {
        config.validate()?;
        let settings = &config.impedance;
        let form = match space.impedance {
            Impedance::Adaptive => settings.aforce.form,
            Impedance::Commanded => settings.variable.form,
            Impedance::Fixed(level) => settings.level(level).form,
        };
        let law = (space.impedance == Impedance::Adaptive).then(|| AdaptiveLaw::new(settings.aforce));
        if law.is_some() {
            settings.aforce.check_stability()?;
        }
        Ok(Self {
            space,
            config: *config,
            form,
            dt: config.dt(),
            interpolator: Interpolator::new(&config.interpolation, config.samples_per_action(), config.dt()),
            law,
            force: ForceControl::new(config.force, contact_axis.into_inner()),
            exit: TorqueExit::new(limits),
            goal: Pose::identity(),
            q0: JointVector::zeros(),
            error: Vector6::zeros(),
            stiffness: Vector6::zeros(),
            feedforward: Wrench::zeros(),
            inertia: Vector6::repeat(1.0),
        })
    }

    /// Begins an episode: goal and set-point at the measured pose, the present posture to keep, K(0), no force.
    pub fn reset(&mut self, y: &Measurement) {
        self.goal = y.pose;
        self.q0 = y.q;
        self.interpolator.reset(&y.pose);
        self.force.reset();
        self.exit.reset(&y.bias);
        self.error = Vector6::zeros();
        self.feedforward = Wrench::zeros();
        let settings = &self.config.impedance;
        self.stiffness = match (&mut self.law, self.space.impedance) {
            (Some(law), _) => {
                law.reset();
                *law.stiffness()
            }
            (None, Impedance::Fixed(level)) => settings.level(level).stiffness(),
            // Until the policy speaks: the middle of its range.
            (None, _) => Vector6::from_fn(|axis, _| settings.variable.range(axis).iter().sum::<f64>() / 2.0),
        };
        self.inertia = OperationalSpace::new(&y.mass, &y.jacobian)
            .map_or(Vector6::repeat(1.0), |operational| operational.diagonal());
    }

    /// One policy action, entries in [-1, 1] (others are clipped): a new goal, counted from the reference;
    /// stiffness and force, if commanded, take effect at once.
    ///
    /// # Panics
    /// If `action` has not the length [`ActionSpace::dim`].
    pub fn set_goal(&mut self, action: &[f64], y: &Measurement) {
        let command = decode(self.space, &self.config, action);
        if let Some(stiffness) = command.stiffness {
            self.stiffness = stiffness;
        }
        if let Some(force) = command.force {
            self.force.set_target(force);
        }
        let goal = self.form.reference.next_goal(&self.goal, &y.pose, &command.delta);
        // A diverged plant must not poison the goal; `update` counts the fault.
        if all_finite(&goal.translation.vector) && all_finite(&goal.rotation.coords) {
            self.goal = goal;
            self.interpolator.set_goal(&goal);
        }
    }

    /// One control sample: tau = J^T (-F_ff - F_d - K e - D e_dot) + bias + null space (Nm), limited. The shaped convention
    /// multiplies F_ff, K e and D e_dot by Lambda; for F_d stands F_cmd, with which force control holds it.
    pub fn update(&mut self, y: &Measurement) -> JointVector {
        // Set-point x_d, and how far the force controller owns the contact axis.
        let (x_d, xd_dot) = self.interpolator.step();
        let axis = self.force.axis();

        // Error e = x - x_d and its rate. Along the contact axis, while engaged, the set-point does not move.
        self.error = pose_error(&y.pose, &x_d);
        let reference = if self.form.reference_velocity { axis.release(&xd_dot) } else { Twist::zeros() };
        let e_dot = y.twist - reference;
        let readable = all_finite(&self.error) && all_finite(&e_dot) && all_finite(&y.wrench);
        let Some(operational) = OperationalSpace::new(&y.mass, &y.jacobian).filter(|_| readable) else {
            // The law's state stays clean; gravity compensation holds the arm if it can.
            return self.exit.pass(&JointVector::repeat(f64::NAN), &y.bias, self.dt);
        };

        // K and F_ff (eqs. 4-6), from the errors that are not force control's.
        let mut f_ff = Vector6::zeros();
        if let Some(law) = &mut self.law {
            law.update(&axis.release(&self.error), &axis.release(&e_dot), self.dt);
            (self.stiffness, f_ff) = (*law.stiffness(), *law.feedforward());
            self.feedforward = self.form.to_wrench(&axis.release(&f_ff), &operational);
        }

        // F_cmd in place of F_d.
        let f_cmd = if self.space.force { self.force.update(&y.wrench, self.dt) } else { Wrench::zeros() };

        // Wrench -F_ff - F_cmd - K e - D e_dot.
        let impedance = impedance_wrench(&self.form, &operational, &axis, &self.error, &e_dot, &self.stiffness, &f_ff);
        let wrench = impedance - f_cmd;

        // Joint torques, then the limits.
        let null_space = null_space_torque(y, &operational, &self.q0, self.config.null_space_stiffness);
        let tau = y.jacobian.tr_mul(&wrench) + y.bias + null_space;
        self.inertia = operational.diagonal();
        self.exit.pass(&tau, &y.bias, self.dt)
    }
}

mod readings;
#[cfg(test)]
mod tests;
