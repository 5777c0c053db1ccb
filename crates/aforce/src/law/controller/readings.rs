//! Values of the controller's latest sample. If that sample could not be read ([`faults`](Controller::faults) counts it), errors, wrenches
//! and power are those of the last sample that could.

use super::Controller;
use crate::law::action_space::ActionSpace;
use crate::law::psi::Psi;
use crate::law::stiffness::Stiffness;
use crate::spatial::{Measurement, Pose, Vector3, Vector6, Wrench};

impl Controller {
    /// The action space that this controller decodes.
    #[must_use]
    pub fn space(&self) -> &ActionSpace {
        &self.space
    }

    /// The parameters of the adaptive law in use, if there is one.
    #[must_use]
    pub fn psi(&self) -> Option<&Psi> {
        self.adaptation.as_ref().map(|adaptation| adaptation.psi()).or_else(|| self.space.psi())
    }

    /// K in N/m and Nm/rad. In a space in 1/s^2 this is diag(Lambda) K, which depends on the arm's pose. Along an engaged
    /// contact axis the share [`engagement`](Self::engagement) of it does not act.
    #[must_use]
    pub fn stiffness(&self) -> Vector6 {
        self.effective(&self.stiffness)
    }

    /// `own`, a stiffness in the space's unit, in N/m and Nm/rad at the arm's inertia of the latest sample.
    pub(crate) fn effective(&self, own: &Vector6) -> Vector6 {
        self.space.unit.effective(own, &self.inertia)
    }

    /// n: the direction, in world axes, in which the environment pushes on the tool.
    #[must_use]
    pub fn contact_axis(&self) -> Vector3 {
        self.force.axis().direction
    }

    /// K in the space's own unit.
    #[must_use]
    pub fn own_stiffness(&self) -> &Vector6 {
        &self.stiffness
    }

    /// Bounds between which K of an axis moves, in the space's own unit; `None` if it is constant.
    #[must_use]
    pub fn stiffness_bounds(&self, axis: usize) -> Option<[f64; 2]> {
        match &self.space.stiffness {
            Stiffness::Adaptive(_) => self.psi().map(|psi| [psi.k_min[axis], psi.k_max[axis]]),
            Stiffness::Commanded(range) => Some([range.low[axis], range.high[axis]]),
            Stiffness::Fixed(_) => None,
        }
    }

    /// Stiffness of the spring that F_ff amounts to under a lasting error, alpha/mu (N/m, Nm/rad); zero without F_ff.
    #[must_use]
    pub fn feedforward_spring(&self) -> Vector6 {
        let own = self.psi().map_or(Vector6::zeros(), |psi| *psi.feedforward_spring().vector());
        self.effective(&own)
    }

    /// The tool point's pose (m; world frame) to which the next action adds its delta, given the measurement `y`.
    #[must_use]
    pub fn origin(&self, y: &Measurement) -> Pose {
        self.space.goal.origin(&self.start, &self.goal, &y.pose)
    }

    /// K e of the latest sample as it acts (N, Nm; world axes). It enters the torque law with a minus sign.
    #[must_use]
    pub fn spring_wrench(&self) -> Wrench {
        self.impedance.elastic - self.feedforward
    }

    /// D e_dot of the latest sample as it acts (N, Nm; world axes). It enters the torque law with a minus sign.
    #[must_use]
    pub fn damper_wrench(&self) -> &Wrench {
        &self.impedance.viscous
    }

    /// -F_ff - F_cmd - K e - D e_dot of the latest sample (N, Nm; world axes): the wrench with which the tool is to push.
    #[must_use]
    pub fn wrench(&self) -> &Wrench {
        &self.wrench
    }

    /// Power of [`wrench`](Self::wrench) at the tool's velocity: of its force, and of its moment (W).
    #[must_use]
    pub fn power(&self) -> [f64; 2] {
        self.power
    }

    /// F_ff as it acts (N, Nm; world axes). It enters the torque law with a minus sign.
    #[must_use]
    pub fn feedforward(&self) -> &Wrench {
        &self.feedforward
    }

    /// The force along the contact axis that the latest action asks for (N). F_d ramps to it while in contact.
    #[must_use]
    pub fn requested_force(&self) -> f64 {
        self.force.target()
    }

    /// F_d, to which the force controller holds the force along the contact axis (N); 0 without contact.
    #[must_use]
    pub fn desired_force(&self) -> f64 {
        self.force.desired()
    }

    /// F_cmd, the force controller's output along the contact axis (N): what the environment should exert on the tool.
    #[must_use]
    pub fn force_command(&self) -> f64 {
        self.force.command()
    }

    /// Share of the contact axis that force control has taken over, 0 to 1.
    #[must_use]
    pub fn engagement(&self) -> f64 {
        self.force.axis().engagement
    }

    /// The goal of the latest action, a pose of the tool point (m; world frame).
    #[must_use]
    pub fn goal(&self) -> &Pose {
        &self.goal
    }

    /// The set-point x_d of the latest sample, a pose of the tool point (m; world frame).
    #[must_use]
    pub fn set_point(&self) -> &Pose {
        self.set_point.pose()
    }

    /// e = x - x_d of the latest sample (m, rad; world axes), contact axis included.
    #[must_use]
    pub fn error(&self) -> &Vector6 {
        &self.error
    }

    /// Joints whose torque was cut by a limit in the latest sample.
    #[must_use]
    pub fn saturated(&self) -> [bool; 7] {
        self.limiter.saturated()
    }

    /// Samples since reset without a torque, because measurement or torque was not finite or the mass matrix not positive definite:
    /// the episode has diverged.
    #[must_use]
    pub fn faults(&self) -> u64 {
        self.limiter.faults()
    }
}
