//! The host's bounds on what the law wants of one sample.

use crate::arm::Arm;
use crate::guard::{Active, Guard, Sample};
use crate::host::limits::HostLimits;
use crate::host::status::Limited;
use crate::host::tank::Tank;
use crate::spatial::{JointVector, Measurement, Pose, Vector3, Vector6, Wrench, limit_norm, linear, rotational, stack};

/// Stands between the law and the arm: goals into the workspace, errors clipped, energy paid for, wrench and its rate capped,
/// joints kept from their ends.
#[derive(Debug, Clone)]
pub(crate) struct TaskGuard {
    limits: HostLimits,
    range: [[f64; 2]; 7],
    /// Force below which contact counts as lost (N).
    contact_off: f64,
    tank: Tank,
    /// What growth of K has been paid for and not given back (J).
    paid: f64,
    /// Of F_ff and F_cmd the parts against which the environment works (N, Nm).
    driven: Wrench,
    /// K that acted last, in the space's unit.
    stiffness: Vector6,
    /// The wrench of the last sample (N, Nm), and what was cut off it.
    wrench: Wrench,
    cut: Wrench,
    /// Where the tool last had contact (m).
    contact: Option<Vector3>,
    /// What was cut since the last sample was taken; the goal's flag stays until the next goal.
    pub(crate) limited: Limited,
    pub(crate) goal_limited: bool,
}

impl TaskGuard {
    pub(crate) fn new(limits: &HostLimits, arm: &Arm, contact_off: f64) -> Self {
        Self {
            limits: *limits,
            range: arm.range,
            contact_off,
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

    /// At the start of the law, with K(0).
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

    /// Share of F_cmd that is left (Schindlbeck and Haddadin 2015): all in contact; out of it, less and less the further the tool
    /// goes the way it pushed.
    fn contact_share(&mut self, sample: &Sample) -> f64 {
        let position = sample.y.pose.translation.vector;
        let n = sample.axis.direction;
        if linear(&sample.y.wrench).dot(&n) >= self.contact_off {
            self.contact = Some(position);
        }
        let lost = self.contact.map_or(0.0, |contact| -n.dot(&(position - contact)) / self.limits.contact_loss);
        0.5 * (1.0 + libm::cos(std::f64::consts::PI * lost.clamp(0.0, 1.0)))
    }
}

impl Guard for TaskGuard {
    fn goal(&mut self, goal: Pose) -> Pose {
        let [low, high] = self.limits.workspace.map(Vector3::from);
        let inside = goal.translation.vector.sup(&low).inf(&high);
        self.goal_limited = inside != goal.translation.vector;
        Pose::from_parts(inside.into(), goal.rotation)
    }

    fn error(&mut self, e: Vector6) -> Vector6 {
        let clipped = capped(&e, &self.limits.error_max);
        self.limited.insert(Limited::ERROR, clipped != e);
        clipped
    }

    fn excess(&self, excess: Vector6, e: &Vector6) -> Vector6 {
        // Two units: they do not add up. Along each axis the cut counts where it stops the spring, -K e, else the joints' excess.
        excess.zip_zip_map(&self.cut, e, |excess, cut, e| if -e * cut > 0.0 { cut } else { excess })
    }

    fn active(&mut self, wanted: Active, sample: &Sample) -> Active {
        let e = sample.axis.release(&sample.e);
        let spring = |k: Vector6| 0.5 * e.dot(&sample.unit.to_wrench(&k.component_mul(&e), sample.arm)); // J
        let growth = wanted.stiffness - self.stiffness;
        let (up, down) = (growth.sup(&Vector6::zeros()), growth.inf(&Vector6::zeros()));
        let contact = self.contact_share(sample);
        let force = wanted.force * contact;
        let feedforward = sample.unit.to_wrench(&sample.axis.release(&wanted.feedforward), sample.arm);
        // Both enter the law with a minus sign.
        let work = |f: &Wrench| -f.dot(&sample.y.twist) * sample.dt;

        let costs = [spring(up), work(&feedforward), work(&force)];
        let share = self.tank.share(&costs);
        self.tank.pay(&costs, share);
        // A spring that softens gives back what was paid for it; what moved the set-point was not paid from here.
        self.paid += share * costs[0].max(0.0);
        let back = (-spring(down)).clamp(0.0, self.paid);
        self.paid -= back;
        self.tank.fill(back);
        let driven = |f: Wrench, cost: f64| if cost < 0.0 { share * f } else { Wrench::zeros() };
        self.driven = driven(feedforward, costs[1]) + driven(force, costs[2]);
        self.stiffness = if share < 1.0 { self.stiffness + share * up + down } else { wanted.stiffness };
        self.limited.insert(Limited::ENERGY, share < 1.0);
        self.limited.insert(Limited::CONTACT_LOSS, contact < 1.0 && wanted.force != Wrench::zeros());
        Active { stiffness: self.stiffness, feedforward: share * wanted.feedforward, force: share * force }
    }

    fn wrench(&mut self, wanted: Wrench, viscous: &Wrench, sample: &Sample) -> Wrench {
        let bounded = capped(&wanted, &self.limits.wrench_max);
        let step = self.limits.wrench_rate_max.map(|rate| rate * sample.dt);
        let jump = bounded - self.wrench;
        let allowed = capped(&jump, &step);
        let wrench = if allowed == jump { bounded } else { self.wrench + allowed };
        self.cut = wanted - wrench;
        // What the damper, and who moves the arm against F_ff and F_cmd, take out of it, as far as these act: on the arm's own
        // motion, whatever the set-point does.
        let taken = viscous + self.driven;
        let power = |part: fn(&Vector6) -> Vector3| {
            share(&part(&wrench), &part(&wanted)) * part(&taken).dot(&part(&sample.y.twist)) // W
        };
        self.tank.fill((power(linear) + power(rotational)) * sample.dt);
        self.limited.insert(Limited::WRENCH, wrench != wanted);
        self.wrench = wrench;
        wrench
    }

    fn torque(&mut self, wanted: JointVector, y: &Measurement) -> JointVector {
        let margin = self.limits.joint_margin;
        let mut torque = wanted;
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

/// Its linear and its rotational part shortened to `max`, if longer.
fn capped(v: &Vector6, max: &[f64; 2]) -> Vector6 {
    stack(&limit_norm(linear(v), max[0]), &limit_norm(rotational(v), max[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What joints and cap cut off are of two units; each alone stops a spring that pushes that way.
    #[test]
    fn either_cut_stops_the_spring() {
        let mut guard = TaskGuard::new(&HostLimits::default(), &Arm::PANDA, 1.5);
        guard.cut = Vector6::new(-4.0, 4.0, -4.0, 0.0, 0.0, 0.0);
        let excess = Vector6::new(5.0, 5.0, -5.0, 5.0, -5.0, 0.0);
        for (e, stopped) in
            [(-1.0, [true, true, false, true, false, false]), (1.0, [true, false, true, false, true, false])]
        {
            let e = Vector6::repeat(e);
            let effective = guard.excess(excess, &e);
            let found: Vec<bool> = (0..6).map(|axis| -e[axis] * effective[axis] > 0.0).collect();
            assert_eq!(found, stopped, "an error of {}", e[0]);
        }
    }
}
