//! What the controller can tell about its latest sample.

use super::Controller;
use crate::action_space::ActionSpace;
use crate::impedance::Convention;
use crate::reference::Reference;
use crate::spatial::{Measurement, Pose, Vector6, Wrench};

impl Controller {
    /// The action space that this controller decodes.
    #[must_use]
    pub fn space(&self) -> ActionSpace {
        self.space
    }

    /// K in N/m and Nm/rad. In the shaped convention this is diag(Lambda) kp, which depends on the arm's pose. Along an
    /// engaged contact axis the share [`engagement`](Self::engagement) of it does not act.
    #[must_use]
    pub fn stiffness(&self) -> Vector6 {
        match self.form.convention {
            Convention::Physical => self.stiffness,
            Convention::Shaped => self.stiffness.component_mul(&self.inertia),
        }
    }

    /// K in the units of the space's own convention (shaped: kp in 1/s^2).
    #[must_use]
    pub fn own_stiffness(&self) -> &Vector6 {
        &self.stiffness
    }

    /// The convention of [`own_stiffness`](Self::own_stiffness).
    #[must_use]
    pub fn convention(&self) -> Convention {
        self.form.convention
    }

    /// The pose to which an action that comes now adds its delta: the measured one, or the last goal (which its leash pulls
    /// in first where the tool has been pushed further away).
    #[must_use]
    pub fn origin<'a>(&'a self, y: &'a Measurement) -> &'a Pose {
        match self.form.reference {
            Reference::Rebased {} => &y.pose,
            Reference::Continued { .. } => &self.goal,
        }
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

    /// The goal of the latest action.
    #[must_use]
    pub fn goal(&self) -> &Pose {
        &self.goal
    }

    /// The set-point x_d of the latest sample.
    #[must_use]
    pub fn set_point(&self) -> &Pose {
        self.interpolator.pose()
    }

    /// e = x - x_d of the latest sample (m, rad; world axes), contact axis included.
    #[must_use]
    pub fn error(&self) -> &Vector6 {
        &self.error
    }

    /// Joints whose torque was cut by a limit in the latest sample.
    #[must_use]
    pub fn saturated(&self) -> [bool; 7] {
        self.exit.saturated()
    }

    /// Samples since reset whose measurement or torque was not finite: the episode has diverged.
    #[must_use]
    pub fn faults(&self) -> u64 {
        self.exit.faults()
    }
}
