//! What happened during one action: energy, force, stiffness.

use aforce::{Controller, EnergyLedger, JointVector};
use physics::ContactReading;

/// Record of one action, summed or averaged over its control samples.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Interval {
    /// Control samples taken in.
    pub samples: u32,
    /// Energy in every definition.
    pub energy: EnergyLedger,
    /// Sum over samples of the torque of each joint, gravity compensation included (Nm).
    pub sum_torque: JointVector,
    /// Net work of each joint (J): the integral of tau_i qd_i.
    pub joint_work: JointVector,
    /// Largest norm of the sustained contact force (N).
    pub max_force: f64,
    /// Sum over samples of the norm of the sustained contact force (N).
    pub sum_force: f64,
    /// Largest norm of the raw contact force (N).
    pub max_raw_force: f64,
    /// Integral of the sustained force above the limit (N s).
    pub excess_impulse: f64,
    /// Time with contact beyond the wrist (s).
    pub contact_time: f64,
    /// Sum over samples of the mean translational stiffness, in the unit of the action
    /// space's own convention (1/s2 or N/m).
    pub sum_stiffness: f64,
    /// Sum over samples of the share of joints whose torque was limited.
    pub sum_saturated: f64,
}

impl Interval {
    /// Takes in one control sample of `dt` seconds: the torque that acted, the mean joint velocity meanwhile (the work of a
    /// torque that acts over the whole sample goes with it), and the contact after it.
    pub fn add(
        &mut self,
        tau: &JointVector,
        qd: &JointVector,
        contact: &ContactReading,
        controller: &Controller,
        force_limit: f64,
        dt: f64,
    ) {
        let force = contact.sustained_force();
        self.samples += 1;
        self.energy.add(tau, qd, dt);
        self.sum_torque += tau;
        self.joint_work += tau.component_mul(qd) * dt;
        self.max_force = self.max_force.max(force);
        self.sum_force += force;
        self.max_raw_force = self.max_raw_force.max(contact.raw.fixed_rows::<3>(0).norm());
        self.excess_impulse += (force - force_limit).max(0.0) * dt;
        self.contact_time += if contact.touching { dt } else { 0.0 };
        self.sum_stiffness += controller.own_stiffness().fixed_rows::<3>(0).mean();
        self.sum_saturated += controller.saturated().iter().filter(|&&limited| limited).count() as f64 / 7.0;
    }

    /// Mean translational stiffness (1/s2 or N/m: the action space's own convention).
    pub fn mean_stiffness(&self) -> f64 {
        self.sum_stiffness / f64::from(self.samples.max(1))
    }

    /// Mean torque of each joint (Nm).
    pub fn mean_torque(&self) -> JointVector {
        self.sum_torque / f64::from(self.samples.max(1))
    }

    /// Mean norm of the sustained contact force (N).
    pub fn mean_force(&self) -> f64 {
        self.sum_force / f64::from(self.samples.max(1))
    }

    /// Share of joint torques that were limited.
    pub fn saturated(&self) -> f64 {
        self.sum_saturated / f64::from(self.samples.max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aforce::{ControllerConfig, Jacobian, JointMatrix, Measurement, Pose, TorqueLimits, Twist, Vector3, Wrench};

    /// A controller after one sample at its goal. It holds each joint with 1 Nm, of which the first `limited` joints take
    /// half. `kp` commands the stiffness, -1 being 0 and 1 being 300.
    fn controller(kp: [f64; 6], limited: usize) -> Controller {
        let y = Measurement {
            q: JointVector::zeros(),
            qd: JointVector::zeros(),
            pose: Pose::identity(),
            twist: Twist::zeros(),
            jacobian: Jacobian::identity(),
            mass: JointMatrix::identity(),
            bias: JointVector::repeat(1.0),
            wrench: Wrench::zeros(),
        };
        let max = JointVector::from_fn(|i, _| if i < limited { 0.5 } else { 10.0 });
        let (space, limits) = ("variable".parse().unwrap(), TorqueLimits { max, rate: None });
        let mut controller =
            Controller::new(space, &ControllerConfig::default(), limits, Vector3::z_axis()).expect("defaults");
        controller.reset(&y);
        controller.set_goal(&[kp, [0.0; 6]].concat(), &y);
        controller.update(&y);
        controller
    }

    /// What a record says is worked out by hand for three samples of 2 ms, the second of which is the extreme one.
    #[test]
    fn sums_means_and_extremes_are_over_all_samples() {
        const DT: f64 = 0.002;
        const LIMIT: f64 = 15.0;
        // Sustained forces of 10, 80 and 20 N; moments are no forces. The low-pass outlasts the touch.
        let contact = |x: f64, y: f64, z: f64, touching| {
            let sustained = Wrench::new(x, y, z, 500.0, 500.0, 500.0);
            ContactReading { sustained, raw: 2.0 * sustained, touching, ..ContactReading::default() }
        };
        let contacts = [contact(6.0, 0.0, 8.0, true), contact(0.0, -80.0, 0.0, true), contact(12.0, 0.0, -16.0, false)];
        let controllers = [
            controller([-1.0, 0.0, 1.0, 1.0, 1.0, 1.0], 0),
            controller([1.0, 1.0, 1.0, -1.0, -1.0, -1.0], 5),
            controller([-1.0, -1.0, -0.4, 0.0, 0.0, 0.0], 2),
        ];
        // Joint 1 has the torque given here, joint 2 twice as much, and so on; all move alike.
        let torques = [3.0, -6.0, 9.0].map(|torque| JointVector::from_fn(|i, _| torque * (i + 1) as f64));
        let speeds = [0.5, 1.0, 0.0].map(JointVector::repeat);

        let mut interval = Interval::default();
        for k in 0..3 {
            interval.add(&torques[k], &speeds[k], &contacts[k], &controllers[k], LIMIT, DT);
        }

        let close = |name: &str, a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{name}: {a}, not {b}");
        assert_eq!(interval.samples, 3);
        close("largest force", interval.max_force, 80.0);
        close("largest raw force", interval.max_raw_force, 160.0);
        close("mean force", interval.mean_force(), 110.0 / 3.0);
        close("impulse above 15 N", interval.excess_impulse, (65.0 + 5.0) * DT);
        close("time of contact", interval.contact_time, 2.0 * DT);
        // Means over x, y, z: 150, 300 and 30.
        close("stiffness", interval.mean_stiffness(), 160.0);
        close("saturated", interval.saturated(), (5.0 + 2.0) / 21.0);
        for i in 0..7 {
            let factor = (i + 1) as f64;
            close("torque", interval.mean_torque()[i], 2.0 * factor);
            close("work of a joint", interval.joint_work[i], (1.5 - 6.0) * factor * DT);
        }
        close("net energy", interval.energy.net, 28.0 * (1.5 - 6.0) * DT);
        close("absolute energy", interval.energy.absolute, 28.0 * (1.5 + 6.0) * DT);
    }

    /// An action that diverged in its first sample has means all the same.
    #[test]
    fn means_over_no_sample_are_zero() {
        let interval = Interval::default();
        assert_eq!((interval.mean_stiffness(), interval.mean_force(), interval.saturated()), (0.0, 0.0, 0.0));
        assert_eq!(interval.mean_torque(), JointVector::zeros());
    }
}
