//! Dry friction of the joints, as efforts that are worked out before each step of the engine.
//!
//! Coulomb's law, implicit in time: a joint's friction brings the velocity that the joint would have after the step to
//! zero, or as near as its limit allows. The engine can do the same among its constraints, but there every joint costs a
//! solve with the mass matrix and a row in every sweep. Here the arm takes one factorisation of its own mass matrix.
//!
//! The load that friction has to hold is predicted: gravity and Coriolis torques come from the arm's model, and whatever
//! else acted in the last step (contacts, a payload, the weight of a finger) is assumed to act again. In a static contact
//! friction and contact force may share a load in many ways. The share with which the contact was made persists.

use aforce::{JointMatrix, JointVector, Measurement};
use nalgebra::{Cholesky, SVector};

use crate::scene::Axis;

/// Largest number of sweeps over the joints, for an arm of which some joints stand still; mostly fewer are needed.
const SWEEPS: usize = 50;
/// Where the sweeps end: largest change of an impulse, as a part of its limit.
const PRECISION: f64 = 1e-9;

/// Dry friction of all joints, those of the arm first.
pub(crate) struct DryFriction {
    joints: Vec<Joint>,
    /// How many of them are the arm's.
    of_arm: usize,
    /// Largest impulse of each joint of the arm in a step (Nm s).
    arm_limit: JointVector,
    /// What damping adds to the arm's mass matrix in a step (kg m2).
    arm_damping: JointVector,
    /// Length of a step of the engine (s).
    dt: f64,
    /// Effort on each joint beyond model and given efforts (Nm or N), as learned from the steps so far.
    missed: Vec<f64>,
    // Work space of a step: velocities as predicted, and the mass matrix of the arm with its damping.
    predicted: Vec<f64>,
    mass: JointMatrix,
}

/// Numbers of one joint. A joint that is not the arm's is predicted without regard to the others.
struct Joint {
    /// Largest impulse in a step (Nm s or N s).
    limit: f64,
    /// Inertia (kg m2 or kg), what damping adds to it in a step included.
    inertia: f64,
    /// Nm s/rad or N s/m
    damping: f64,
}

impl DryFriction {
    /// Friction of the joints `axes`, which have the given `inertias` (kg m2 or kg), for steps of `dt` (s). The first `of_arm`
    /// joints are the arm's, of which [`DryFriction::apply`] gets the mass matrix.
    ///
    /// # Panics
    /// If a friction is below 0 or not finite.
    pub fn new(axes: &[Axis], inertias: &[f64], of_arm: usize, dt: f64) -> Self {
        for Axis { name, friction, .. } in axes {
            assert!(
                *friction >= 0.0 && friction.is_finite(),
                "joint {name:?} has a dry friction of {friction}: it must be finite and at least 0"
            );
        }
        let joint = |(axis, inertia): (&Axis, &f64)| Joint {
            limit: axis.friction * dt,
            inertia: inertia + axis.damping * dt,
            damping: axis.damping,
        };
        let arm =
            |value: fn(&Axis) -> f64| JointVector::from_fn(|i, _| if i < of_arm { value(&axes[i]) * dt } else { 0.0 });
        DryFriction {
            joints: axes.iter().zip(inertias).map(joint).collect(),
            of_arm,
            arm_limit: arm(|axis| axis.friction),
            arm_damping: arm(|axis| axis.damping),
            dt,
            missed: vec![0.0; axes.len()],
            predicted: vec![0.0; axes.len()],
            mass: JointMatrix::zeros(),
        }
    }

    /// Starts an episode: no effort has been learned.
    pub fn reset(&mut self) {
        self.missed.fill(0.0);
    }

    /// Adds friction to the `efforts` (Nm or N) of the coming step; `velocity` is that of each joint (rad/s or m/s).
    pub fn apply(&mut self, arm: &Measurement, velocity: impl Fn(usize) -> f64, efforts: &mut [f64]) {
        self.apply_to_arm(arm, efforts);
        for (i, joint) in self.joints.iter().enumerate().skip(self.of_arm).filter(|(_, joint)| joint.limit > 0.0) {
            let v = velocity(i);
            let driven = joint.inertia * v + self.dt * (efforts[i] - joint.damping * v + self.missed[i]);
            let impulse = (-driven).clamp(-joint.limit, joint.limit);
            self.predicted[i] = (driven + impulse) / joint.inertia;
            efforts[i] += impulse / self.dt;
        }
    }

    fn apply_to_arm(&mut self, arm: &Measurement, efforts: &mut [f64]) {
        if self.arm_limit == JointVector::zeros() {
            return;
        }
        self.mass = arm.mass + JointMatrix::from_diagonal(&self.arm_damping);
        let factors = self.mass.cholesky().expect("a mass matrix");
        let acting = |i: usize| if i < self.of_arm { efforts[i] + self.missed[i] } else { 0.0 };
        let effort = JointVector::from_fn(|i, _| acting(i)) - arm.bias;
        // Damping is implicit: (M + D dt) qd_after = M qd + effort dt.
        let driven = arm.mass * arm.qd + effort * self.dt;
        let free = factors.solve(&driven);
        // Most often every joint goes on in the direction in which it would without friction.
        let mut impulse = free.zip_map(&self.arm_limit, |v, limit| -limit.copysign(v));
        let mut after = factors.solve(&(driven + impulse));
        if (0..7).any(|i| self.arm_limit[i] > 0.0 && after[i] * free[i] <= 0.0) {
            impulse = stick(&factors, &free, &self.arm_limit);
            after = factors.solve(&(driven + impulse));
        }
        self.predicted[..self.of_arm].copy_from_slice(&after.as_slice()[..self.of_arm]);
        for (effort, impulse) in efforts.iter_mut().zip(&impulse).take(self.of_arm) {
            *effort += impulse / self.dt;
        }
    }

    /// Learns the effort that the prediction missed from the `velocity` of each joint after the step (rad/s or m/s).
    pub fn learn(&mut self, velocity: impl Fn(usize) -> f64) {
        if self.arm_limit != JointVector::zeros() {
            let of_arm = self.of_arm;
            let change = |i| if i < of_arm { velocity(i) - self.predicted[i] } else { 0.0 };
            let missed = self.mass * SVector::from_fn(|i, _| change(i)) / self.dt;
            self.missed.iter_mut().zip(&missed).take(of_arm).for_each(|(sum, missed)| *sum += missed);
        }
        for (i, joint) in self.joints.iter().enumerate().skip(self.of_arm).filter(|(_, joint)| joint.limit > 0.0) {
            self.missed[i] += joint.inertia * (velocity(i) - self.predicted[i]) / self.dt;
        }
    }
}

/// Impulses (Nm s) within `limit` that bring the velocities, `free` without them, to zero where they can: projected
/// Gauss-Seidel, as in an engine's solver.
fn stick(mass: &Cholesky<f64, nalgebra::Const<7>>, free: &JointVector, limit: &JointVector) -> JointVector {
    let mobility = mass.inverse();
    let mut impulse = JointVector::zeros();
    for _ in 0..SWEEPS {
        let mut change: f64 = 0.0;
        for i in (0..7).filter(|&i| limit[i] > 0.0) {
            let velocity = free[i] + mobility.column(i).dot(&impulse);
            let next = (impulse[i] - velocity / mobility[(i, i)]).clamp(-limit[i], limit[i]);
            change = change.max((next - impulse[i]).abs() / limit[i]);
            impulse[i] = next;
        }
        if change < PRECISION {
            break;
        }
    }
    impulse
}

#[cfg(test)]
mod tests {
    use aforce::Vector3;

    use super::*;
    use crate::gripper::GRIP_SITE;
    use crate::model::Model;
    use crate::robots::RobotName;
    use crate::robots::panda::HOME;
    use crate::scenes::lift;

    /// Joints that friction can hold stand still; the others are braked by the largest impulse that friction has.
    #[test]
    fn friction_holds_what_it_can_and_brakes_the_rest() {
        let (scene, gripper) = lift::scene(&RobotName::Robosuite.robot(), Vector3::repeat(0.021));
        let model = Model::new(&scene, gripper, GRIP_SITE);
        let mass = model.mass(&model.kinematics(&HOME.into()));
        let factors = mass.cholesky().unwrap();
        let limit = JointVector::repeat(2e-4);
        // The second joint is driven by four times its friction, the fifth by half of it.
        let mut driven = JointVector::zeros();
        (driven[1], driven[4]) = (8e-4, 1e-4);
        let impulse = stick(&factors, &factors.solve(&driven), &limit);
        let after = factors.solve(&(driven + impulse));
        assert!(after[1] > 1e-5, "{after}");
        for i in 0..7 {
            assert!(impulse[i].abs() <= limit[i]);
            let held = after[i].abs() < 1e-9;
            let braked = impulse[i] == -limit[i].copysign(after[i]);
            assert!(held || braked, "joint {i}: {} after {}", after[i], impulse[i]);
        }
        assert!(after[4].abs() < 1e-9, "{after}");
    }

    #[test]
    #[should_panic(expected = "joint \"joint3\" has a dry friction of -0.1: it must be finite and at least 0")]
    fn a_friction_that_drives_is_refused() {
        let mut axes =
            crate::engine::Engine::new(&lift::scene(&RobotName::Robosuite.robot(), Vector3::repeat(0.021)).0, 0.002, 1)
                .axes()
                .to_vec();
        axes[2].friction = -0.1;
        DryFriction::new(&axes, &[1.0; 9], 7, 0.002);
    }
}
