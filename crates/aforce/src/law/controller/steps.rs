//! The law: one control sample in the order of the paper's equations.
//!
//! Plain values pass from step to step. [`Controller::update`] hands them on as they are. A [`Host`](crate::host::Host) calls
//! the same steps and bounds the values between two of them.

use super::Controller;
use crate::law::action_space::RateRule;
use crate::law::impedance::{Impedance, impedance};
use crate::law::null_space::null_space_torque;
use crate::law::operational_space::OperationalSpace;
use crate::law::step_values::{Adapted, Errors};
use crate::spatial::{JointVector, Measurement, Vector6, Wrench, all_finite};

impl Controller {
    /// e and e_dot of a sample `dt` seconds after the last; `None` if the sample cannot be read. K, F_ff and F_d then stay as they were.
    pub(crate) fn sense(&mut self, y: &Measurement, dt: f64) -> Option<Errors> {
        let (x_d, xd_dot) = self.set_point.step(dt);
        let axis = self.force.axis();
        let e = self.space.rotation_error.of(&y.pose, &x_d); // e = x - x_d
        let e_dot = match self.space.rate {
            // Along the contact axis the set-point counts as resting, in the share that force control owns.
            RateRule::SetPoint => y.twist - axis.release(&xd_dot),
            RateRule::Standstill => y.twist,
        };
        let adapts = self.adaptation.is_some();
        // Computed before Lambda: with a branch after it the compiler copies the `OperationalSpace` once more.
        let excess = if adapts { y.jacobian * self.limiter.excess() } else { Vector6::zeros() };
        let joints = all_finite(&y.q) && all_finite(&y.qd) && all_finite(&y.bias);
        // A space without force reads no wrench.
        let wrench = !self.space.force || all_finite(&y.wrench);
        let readable = joints && all_finite(&e) && all_finite(&e_dot) && wrench;
        let lambda = OperationalSpace::new(&y.mass, &y.jacobian).filter(|_| readable)?;
        self.error = e;
        Some(Errors { e, e_dot, excess, axis, lambda, dt })
    }

    /// K and F_ff (eqs. 4 to 6), from the part of the errors that force control does not own, and F_cmd in place of F_d.
    pub(crate) fn adapt(&mut self, errors: &Errors, y: &Measurement) -> Adapted {
        let Errors { axis, excess, dt, .. } = errors;
        let mut adapted = Adapted { stiffness: self.stiffness, feedforward: Vector6::zeros(), force: Wrench::zeros() };
        if let Some(adaptation) = &mut self.adaptation {
            adaptation.update(&axis.release(&errors.e), &axis.release(&errors.e_dot), excess, *dt); // eqs. 4, 5, 6
            (adapted.stiffness, adapted.feedforward) = (*adaptation.stiffness(), *adaptation.feedforward());
        }
        if self.space.force {
            adapted.force = self.force.update(&y.wrench, *dt);
        }
        adapted
    }

    /// W = -F_ff - K e - D e_dot - F_cmd (N, Nm; world axes), with the K, F_ff and F_cmd that act.
    pub(crate) fn act(&mut self, errors: &Errors, adapted: &Adapted) -> Wrench {
        if let Some(adaptation) = &mut self.adaptation {
            // The next sample's K grows from the one that acts: a host may have bounded it.
            adaptation.set_stiffness(&adapted.stiffness);
            self.stiffness = adapted.stiffness;
            self.feedforward = self.space.unit.to_wrench(&errors.axis.release(&adapted.feedforward), &errors.lambda);
        }
        self.impedance = impedance(&self.space, errors, adapted);
        self.inertia = errors.lambda.diagonal();
        let Impedance { elastic, viscous } = self.impedance; // F_ff + K e and D e_dot
        -elastic - viscous - adapted.force
    }

    /// tau = J^T W + bias + null space (Nm), before the limits of the joints.
    pub(crate) fn torque(&mut self, wrench: &Wrench, lambda: &OperationalSpace, y: &Measurement) -> JointVector {
        self.wrench = *wrench;
        self.power = [0, 3].map(|at| wrench.fixed_rows::<3>(at).dot(&y.twist.fixed_rows::<3>(at)));
        let null_space = null_space_torque(y, lambda, &self.q0, self.config.null_space_stiffness);
        y.jacobian.tr_mul(wrench) + y.bias + null_space
    }
}
