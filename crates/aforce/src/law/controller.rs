//! The controller: one action to one goal, one measurement to one torque.

use std::mem::discriminant;

use nalgebra::UnitVector3;

use crate::arm::Arm;
use crate::error::ConfigError;
use crate::law::action::decode;
use crate::law::action_space::{ActionSpace, SetPoint};
use crate::law::adaptation::AdaptiveLaw;
use crate::law::config::ControllerConfig;
use crate::law::force::ForceControl;
use crate::law::impedance::Impedance;
use crate::law::interpolator::Interpolator;
use crate::law::limits::TorqueLimiter;
use crate::law::operational_space::OperationalSpace;
use crate::law::stiffness::Stiffness;
use crate::spatial::{JointVector, Measurement, Pose, Vector6, Wrench, all_finite};

/// Turns the actions of one [`ActionSpace`] into joint torques.
#[derive(Debug, Clone)]
pub struct Controller {
    space: ActionSpace,
    config: ControllerConfig,
    dt: f64,
    // The parts that have a state of their own.
    set_point: Interpolator,
    adaptation: Option<AdaptiveLaw>,
    force: ForceControl,
    limiter: TorqueLimiter,
    // State of the episode.
    start: Pose,
    goal: Pose,
    q0: JointVector,
    /// Actions since the start. A space that commands psi takes a new psi with every
    /// [`hold`](crate::CommandedPsi::hold)-th action.
    actions: u32,
    error: Vector6,
    /// K in the space's unit.
    stiffness: Vector6,
    // Of the latest sample, as they act: F_ff, spring with F_ff and damper, the whole wrench of the task (N, Nm), and
    // its power (W).
    feedforward: Wrench,
    impedance: Impedance,
    wrench: Wrench,
    power: [f64; 2],
    /// diag(Lambda) of the latest sample.
    inertia: Vector6,
}

impl Controller {
    /// A controller for `space`. `contact_axis` is n: the direction, in world axes, in which the environment pushes on
    /// the tool (+z for a table below), until [`set_contact_axis`](Self::set_contact_axis) turns it; only spaces with force use it. The
    /// torques keep to the limits of `arm`, jerk-limited set-points to a share of what its tool may do. The tool's limits are not checked
    /// here ([`Arm::validate`]). Call [`reset`](Self::reset) before use.
    ///
    /// # Errors
    /// If a value of `space` or `config` is not allowed, a limit of a torque is NaN or negative, or the adaptive law is unstable.
    pub fn new(
        space: &ActionSpace,
        config: &ControllerConfig,
        arm: &Arm,
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
                    Interpolator::new(&config.interpolation, &arm.cartesian, config.samples_per_action(), config.dt())
                }
                SetPoint::Jump => Interpolator::jump(config.dt()),
            },
            adaptation: None,
            force: ForceControl::new(config.force, contact_axis.into_inner()),
            limiter: TorqueLimiter::new(arm.torque_limits()?),
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
        self.adaptation = self.space.psi().map(|psi| AdaptiveLaw::new(*psi));
        self.force.reset();
        self.limiter.reset(&y.bias);
        self.actions = 0;
        self.error = Vector6::zeros();
        self.stiffness = self.space.stiffness.at_reset();
        self.feedforward = Wrench::zeros();
        self.impedance = Impedance { elastic: Wrench::zeros(), viscous: Wrench::zeros() };
        (self.wrench, self.power) = (Wrench::zeros(), [0.0; 2]);
        self.inertia =
            OperationalSpace::new(&y.mass, &y.jacobian).map_or(Vector6::repeat(1.0), |lambda| lambda.diagonal());
    }

    /// Takes one policy action, entries in [-1, 1] (others are clipped). The new goal is its pose delta added to [`origin`](Self::origin);
    /// stiffness, psi and force, if commanded, take effect at once. A goal to which no jerk-limited move can be planned is not taken.
    ///
    /// # Panics
    /// If `action` has another length than [`ActionSpace::dim`].
    pub fn set_goal(&mut self, action: &[f64], y: &Measurement) {
        let goal = self.interpret(action, y);
        self.move_to(&goal);
    }

    /// Turns n, the direction in world axes in which the environment pushes on the tool: the normal of the surface where the tool
    /// touches it. F_d and F_cmd are numbers along n and turn with it, and so does the share of stiffness and F_ff that
    /// force control has taken. Holds from the next sample on, and through a reset.
    pub fn set_contact_axis(&mut self, n: UnitVector3<f64>) {
        self.force.set_direction(n.into_inner());
    }

    /// Replaces the numbers of the stiffness while the law runs. The kind (fixed, commanded or adaptive) must be the
    /// space's. The new numbers hold through a reset. A fixed K acts from the next sample on, and a range from the next
    /// action on. An adaptive K goes from where it is to new bounds at its largest rate, and F_ff goes on from where it
    /// is. Where the policy commands psi, its next choice replaces those of these numbers that it commands.
    ///
    /// # Errors
    /// If the kind is another, or the space is not allowed with these numbers, with the field below `space`. Nothing
    /// has changed then.
    pub fn set_stiffness(&mut self, stiffness: Stiffness) -> Result<(), ConfigError> {
        if discriminant(&stiffness) != discriminant(&self.space.stiffness) {
            let reason = "another kind of stiffness than the running space has; make a new controller".into();
            return Err(ConfigError::Contradiction { field: "space.stiffness".into(), reason });
        }
        let space = ActionSpace { stiffness, ..self.space.clone() };
        if space.dim() != self.space.dim() {
            let reason = format!("actions of {} entries, and the running space has {}", space.dim(), self.space.dim());
            return Err(ConfigError::Contradiction { field: "space.stiffness".into(), reason });
        }
        space.validate(self.config.control_hz)?;
        self.space = space;
        match (&self.space.stiffness, &mut self.adaptation) {
            (Stiffness::Fixed(k), _) => self.stiffness = *k.vector(),
            (Stiffness::Adaptive(psi), Some(adaptation)) => *adaptation.psi_mut() = *psi,
            _ => (),
        }
        Ok(())
    }

    /// The goal that an action asks for, not yet taken. Stiffness, psi and force, if commanded, take effect.
    pub(crate) fn interpret(&mut self, action: &[f64], y: &Measurement) -> Pose {
        let command = decode(&self.space, &self.config, action);
        if let Some(stiffness) = command.stiffness {
            self.stiffness = stiffness;
        }
        if let Some(force) = command.force {
            self.force.set_target(force);
        }
        if let (Some(commanded), Some(psi), Some(adaptation)) =
            (&self.space.commanded_psi, self.space.psi(), &mut self.adaptation)
        {
            if self.actions.is_multiple_of(commanded.hold) {
                let mut psi = *psi;
                commanded.apply(command.psi, &mut psi);
                *adaptation.psi_mut() = psi;
            }
            self.actions += 1;
        }
        self.space.goal.next_goal(&self.start, &self.goal, &y.pose, &command.delta)
    }

    /// Takes a goal. If no move to it can be planned, returns false: the set-point stands still, and
    /// [`goal`](Self::goal) is the old one.
    pub(crate) fn move_to(&mut self, goal: &Pose) -> bool {
        // NaN from a diverged plant must not enter the goal; `update` counts the fault.
        let readable = all_finite(&goal.translation.vector) && all_finite(&goal.rotation.coords);
        let planned = readable && self.set_point.set_goal(goal);
        if planned {
            self.goal = *goal;
        }
        planned
    }

    /// One control sample: tau = J^T (-F_ff - K e - D e_dot - F_cmd) + bias + null space (Nm), limited. The paper has
    /// F_d in place of F_cmd, which is the output of the force controller that holds F_d. With stiffness in 1/s^2 F_ff,
    /// K e and D e_dot are multiplied by Lambda.
    pub fn update(&mut self, y: &Measurement) -> JointVector {
        let errors = self.sense(y, self.dt); // e and e_dot
        let tau = errors.as_ref().map(|errors| {
            let adapted = self.adapt(errors, y); // K and F_ff (eqs. 4 to 6), F_cmd
            let wrench = self.act(errors, &adapted); // W = -F_ff - K e - D e_dot - F_cmd
            self.torque(&wrench, &errors.lambda, y) // tau = J^T W + bias + null space
        });
        // If the sample cannot be read, the limiter counts a fault and passes the bias alone, or zero if that is not
        // finite either.
        self.limiter.pass(&tau.unwrap_or(JointVector::repeat(f64::NAN)), &y.bias, self.dt)
    }

    /// The limiter of the joint torques, the last step of the law.
    pub(crate) fn limiter(&mut self) -> &mut TorqueLimiter {
        &mut self.limiter
    }

    /// Tells force control how much of the last wrench a later bound cut off (N along n), for its anti-windup.
    pub(crate) fn withhold(&mut self, force: f64) {
        self.force.withhold(force);
    }
}

mod readings;
mod steps;
#[cfg(test)]
mod tests;
