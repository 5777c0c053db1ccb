//! The host's bounds on the values between the law's steps.

use crate::arm::Arm;
use crate::host::limits::HostLimits;
use crate::host::status::Limited;
use crate::host::tank::Tank;
use crate::law::step_values::{Adapted, Errors};
use crate::law::stiffness::StiffnessUnit;
use crate::spatial::{JointVector, Measurement, Pose, Vector3, Vector6, Wrench, limit_norm, linear, rotational, stack};

/// The bounds: goals are moved into the workspace, errors clipped, energy paid for, the wrench and its rate capped, and
/// joints pushed back from the ends of their ranges. Each method takes the value that the law wants and returns the one
/// that may act.
#[derive(Debug, Clone)]
pub(crate) struct Bounds {
    limits: HostLimits,
    range: [[f64; 2]; 7],
    /// Force below which contact counts as lost (N).
    contact_off: f64,
    /// The space's unit of stiffness.
    unit: StiffnessUnit,
    tank: Tank,
    /// Energy that the tank has paid for a stiffer spring and has not got back from a softer one (J).
    paid: f64,
    /// F_ff + F_cmd as they act (N, Nm). Each of the two is included only in samples in which the tool moves against its push.
    driven: Wrench,
    /// K that acted last, in the space's unit.
    stiffness: Vector6,
    /// The wrench of the last sample (N, Nm), and what was cut off it.
    wrench: Wrench,
    cut: Wrench,
    /// Where the tool last had contact (m).
    contact: Option<Vector3>,
    /// What was cut since the last status was made; `goal_limited` stays until the next goal.
    pub(crate) limited: Limited,
    pub(crate) goal_limited: bool,
}

impl Bounds {
    pub(crate) fn new(limits: &HostLimits, arm: &Arm, contact_off: f64, unit: StiffnessUnit) -> Self {
        Self {
            limits: *limits,
            range: arm.range,
            contact_off,
            unit,
            tank: Tank::new(limits.tank),
            paid: 0.0,
            driven: Wrench::zeros(),
            stiffness: Vector6::zeros(),
            wrench: Wrench::zeros(),
            cut: Wrench::zeros(),
            contact: None,
            limited: Limited::default(),
            goal_limited: false,
        }
    }

    /// Resets the bounds at the start of the law. `stiffness` is K(0).
    pub(crate) fn reset(&mut self, stiffness: &Vector6) {
        self.tank = Tank::new(self.limits.tank);
        (self.paid, self.driven) = (0.0, Wrench::zeros());
        self.stiffness = *stiffness;
        (self.wrench, self.cut, self.contact) = (Wrench::zeros(), Wrench::zeros(), None);
        (self.limited, self.goal_limited) = (Limited::default(), false);
    }

    /// K that acts, in the space's unit.
    pub(crate) fn stiffness(&self) -> &Vector6 {
        &self.stiffness
    }

    pub(crate) fn tank(&self) -> &Tank {
        &self.tank
    }

    /// The goal of an action (m), moved into the workspace.
    pub(crate) fn goal(&mut self, wanted: &Pose) -> Pose {
        let [low, high] = self.limits.workspace.map(Vector3::from);
        let inside = wanted.translation.vector.sup(&low).inf(&high);
        self.goal_limited = inside != wanted.translation.vector;
        Pose::from_parts(inside.into(), wanted.rotation)
    }

    /// e = x - x_d (m, rad), clipped for spring and adaptation.
    pub(crate) fn error(&mut self, e: &Vector6) -> Vector6 {
        let clipped = capped(e, &self.limits.error_max);
        self.limited.insert(Limited::ERROR, clipped != *e);
        clipped
    }

    /// What the limits cut off the last sample, seen at the tool, for the anti-windup of the adaptation: K does not grow along an axis
    /// where the spring, -K e, pushes in the direction of the cut. `e` is the error that the adaptation sees.
    pub(crate) fn excess(&self, excess: &Vector6, e: &Vector6) -> Vector6 {
        // The joints' excess and the wrench that was cut have different units and cannot be added. Where the wrench that was cut has the
        // direction of the spring, -K e, that wrench counts; along the other axes the joints' excess counts.
        excess.zip_zip_map(&self.cut, e, |excess, cut, e| if -e * cut > 0.0 { cut } else { excess })
    }

    /// K, F_ff and F_cmd, reduced so that the tank can pay for the energy that they put into the arm.
    pub(crate) fn adapted(&mut self, wanted: &Adapted, errors: &Errors, y: &Measurement) -> Adapted {
        let (Errors { axis, lambda, dt, .. }, unit) = (errors, self.unit);
        let e = axis.release(&errors.e);
        let spring = |k: Vector6| 0.5 * e.dot(&unit.to_wrench(&k.component_mul(&e), lambda)); // J
        let growth = wanted.stiffness - self.stiffness;
        let (up, down) = (growth.sup(&Vector6::zeros()), growth.inf(&Vector6::zeros()));
        let contact = self.contact_share(&axis.direction, y);
        let force = wanted.force * contact;
        let feedforward = unit.to_wrench(&axis.release(&wanted.feedforward), lambda);
        // Both enter the law with a minus sign.
        let work = |f: &Wrench| -f.dot(&y.twist) * dt;

        let costs = [spring(up), work(&feedforward), work(&force)];
        let share = self.tank.share(&costs);
        self.tank.pay(&costs, share);
        // A spring that softens gives back what the tank paid for it, and no more: energy that a moving set-point put into the spring did
        // not come from the tank.
        self.paid += share * costs[0].max(0.0);
        let back = (-spring(down)).clamp(0.0, self.paid);
        self.paid -= back;
        self.tank.fill(back);
        let driven = |f: Wrench, cost: f64| if cost < 0.0 { share * f } else { Wrench::zeros() };
        self.driven = driven(feedforward, costs[1]) + driven(force, costs[2]);
        self.stiffness = if share < 1.0 { self.stiffness + share * up + down } else { wanted.stiffness };
        self.limited.insert(Limited::ENERGY, share < 1.0);
        self.limited.insert(Limited::CONTACT_LOSS, contact < 1.0 && wanted.force != Wrench::zeros());
        Adapted { stiffness: self.stiffness, feedforward: share * wanted.feedforward, force: share * force }
    }

    /// Share of F_cmd that acts (Schindlbeck and Haddadin 2015): 1 in contact. After contact is lost the share falls to
    /// 0 over `contact_loss` metres in the direction in which the tool pushed. `n` is the contact axis.
    fn contact_share(&mut self, n: &Vector3, y: &Measurement) -> f64 {
        let position = y.pose.translation.vector;
        if linear(&y.wrench).dot(n) >= self.contact_off {
            self.contact = Some(position);
        }
        let lost = self.contact.map_or(0.0, |contact| -n.dot(&(position - contact)) / self.limits.contact_loss);
        0.5 * (1.0 + libm::cos(std::f64::consts::PI * lost.clamp(0.0, 1.0)))
    }

    /// The task's wrench (N, Nm) with its size and its rate capped, in a sample of `dt` seconds. `wanted` includes the damper's wrench,
    /// -`viscous`.
    pub(crate) fn wrench(&mut self, wanted: &Wrench, viscous: &Wrench, y: &Measurement, dt: f64) -> Wrench {
        let bounded = capped(wanted, &self.limits.wrench_max);
        let step = self.limits.wrench_rate_max.map(|rate| rate * dt);
        let jump = bounded - self.wrench;
        let allowed = capped(&jump, &step);
        let wrench = if allowed == jump { bounded } else { self.wrench + allowed };
        self.cut = wanted - wrench;
        // The damper takes energy out of the arm, and so does motion against F_ff and F_cmd. The tank receives the share of this energy
        // that is left after the cut. The energy is computed at the tool's own velocity, because with a moving set-point the damper may put
        // energy into the arm.
        let taken = viscous + self.driven;
        let power = |part: fn(&Vector6) -> Vector3| {
            share(&part(&wrench), &part(wanted)) * part(&taken).dot(&part(&y.twist)) // W
        };
        self.tank.fill((power(linear) + power(rotational)) * dt);
        self.limited.insert(Limited::WRENCH, wrench != *wanted);
        self.wrench = wrench;
        wrench
    }

    /// The torque (Nm) with a push that keeps joints away from the ends of their ranges, before the torque limits.
    pub(crate) fn torque(&mut self, wanted: &JointVector, y: &Measurement) -> JointVector {
        let margin = self.limits.joint_margin;
        let mut torque = *wanted;
        for (joint, ([low, high], stiffness)) in self.range.into_iter().zip(self.limits.joint_stiffness).enumerate() {
            let beyond = (y.q[joint] - (high - margin)).max(0.0) + (y.q[joint] - (low + margin)).min(0.0);
            torque[joint] -= stiffness * beyond;
            self.limited.insert(Limited::JOINT_RANGE, beyond != 0.0);
        }
        torque
    }
}

/// The share of `wanted` that is left in `actual`.
fn share(actual: &Vector3, wanted: &Vector3) -> f64 {
    let whole = wanted.norm_squared();
    if whole > 0.0 { (actual.dot(wanted) / whole).clamp(0.0, 1.0) } else { 1.0 }
}

/// `v` with its linear and its rotational part each shortened to its `max`, if longer.
fn capped(v: &Vector6, max: &[f64; 2]) -> Vector6 {
    stack(&limit_norm(linear(v), max[0]), &limit_norm(rotational(v), max[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spring is stopped by either cut in its direction: that of the joints' limits and that of the wrench's cap.
    #[test]
    fn either_cut_stops_the_spring() {
        let mut bounds = Bounds::new(&HostLimits::default(), &Arm::PANDA, 1.5, StiffnessUnit::NewtonPerMetre);
        bounds.cut = Vector6::new(-4.0, 4.0, -4.0, 0.0, 0.0, 0.0);
        let excess = Vector6::new(5.0, 5.0, -5.0, 5.0, -5.0, 0.0);
        for (e, stopped) in
            [(-1.0, [true, true, false, true, false, false]), (1.0, [true, false, true, false, true, false])]
        {
            let e = Vector6::repeat(e);
            let effective = bounds.excess(&excess, &e);
            let found: Vec<bool> = (0..6).map(|axis| -e[axis] * effective[axis] > 0.0).collect();
            assert_eq!(found, stopped, "an error of {}", e[0]);
        }
    }
}
