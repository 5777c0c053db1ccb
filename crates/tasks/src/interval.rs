//! What happened during one action: energy, force, stiffness.

use aforce::{Arm, Controller, EnergyLedger, JointVector, Vector3};
use physics::{ContactReading, Plant};

use crate::axis_group::AxisGroup;
use crate::force_record::ForceRecord;
use crate::motion::Motion;
use crate::penalty::{CountedForce, ForcePenalty};
use crate::protection::{Protection, StopReason, speed_share};

/// A sustained force beyond the wrist above this counts as a hard one (N): the AI for Industry Challenge's threshold.
pub(crate) const HARD_FORCE: f64 = 20.0;

/// Record of one action, summed or averaged over its control samples.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Interval {
    /// Control samples taken in.
    pub samples: u32,
    /// Their duration (s).
    pub time: f64,
    /// Energy in every definition.
    pub energy: EnergyLedger,
    /// Sum over samples of the torque of each joint, gravity compensation included (Nm).
    pub sum_torque: JointVector,
    /// Net work of each joint (J): the integral of tau_i qd_i.
    pub joint_work: JointVector,
    /// Contact force beyond the wrist.
    pub hand: ForceRecord,
    /// Contact force of the whole arm: beyond the wrist and on every link.
    pub arm: ForceRecord,
    /// Integral of the force that the penalty counts above its limit (N s).
    pub excess_impulse: f64,
    /// Time with contact beyond the wrist (s).
    pub contact_time: f64,
    /// Integral of the hand's sustained force over `contact_time` (N s).
    pub contact_impulse: f64,
    /// Time in which the hand's sustained force is above 20 N (s).
    pub hard_time: f64,
    /// Time with contact between the scene and the links short of the wrist (s).
    pub link_contact_time: f64,
    /// Time with contact between two parts of the arm (s).
    pub self_contact_time: f64,
    /// Deepest overlap of any two bodies (m). Bodies are rigid, so millimetres would be a defect of the simulation.
    pub overlap: f64,
    /// Sum over samples of the mean translational stiffness, in the action space's own unit (1/s2 or N/m).
    pub sum_own_stiffness: f64,
    /// The impedance of the translational axes and of the rotational ones.
    pub impedance: [AxisGroup; 2],
    /// Sum over samples of the share of joints whose torque a limit cut.
    pub sum_saturated: f64,
    /// Displacement of the tool (m, world).
    pub displacement: Vector3,
    /// Length of the tool's path (m).
    pub path: f64,
    /// Integral of the size of the tool's jerk over the time in which it moves (m/s2).
    pub sum_jerk: f64,
    /// The time over which `sum_jerk` is integrated (s).
    pub moving_time: f64,
    /// Largest speed of a joint, as a share of that joint's limit.
    pub max_speed_share: f64,
    /// When a real arm would first have stopped itself during this action.
    pub stop: Option<Stop>,
}

/// The moment in an action at which a real arm would have stopped itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// Time since the action began (s).
    pub time: f64,
    /// Why.
    pub reason: StopReason,
}

impl Interval {
    /// Adds one control sample of `plant`: the torque that acted (Nm), the mean of the joint velocities before and
    /// after the sample (rad/s), and the contact after each of the sample's equally long parts. Torque times mean
    /// velocity is the work of a torque that is constant over the sample.
    pub fn add(
        &mut self,
        tau: &JointVector,
        qd: &JointVector,
        contacts: &[ContactReading],
        controller: &Controller,
        penalty: &ForcePenalty,
        plant: &Plant,
    ) {
        let dt = plant.dt;
        self.samples += 1;
        self.time += dt;
        self.energy.add(tau, qd, &plant.robot.drives, dt);
        self.sum_torque += tau;
        self.joint_work += tau.component_mul(qd) * dt;
        let part = dt / contacts.len() as f64;
        for contact in contacts {
            self.hand.add(contact.hand_force(), contact.raw.fixed_rows::<3>(0).norm(), part);
            self.arm.add(contact.arm_force(), contact.raw_arm_force(), part);
            self.excess_impulse += (self.force(penalty.of).last - penalty.limit).max(0.0) * part;
            self.contact_time += if contact.touching { part } else { 0.0 };
            self.contact_impulse += if contact.touching { contact.hand_force() * part } else { 0.0 };
            self.hard_time += if contact.hand_force() > HARD_FORCE { part } else { 0.0 };
            self.link_contact_time += if contact.links.touching { part } else { 0.0 };
            self.self_contact_time += if contact.touching_itself { part } else { 0.0 };
        }
        self.sum_own_stiffness += controller.own_stiffness().fixed_rows::<3>(0).mean();
        for (group, first) in self.impedance.iter_mut().zip([0, 3]) {
            group.add(first, controller, dt);
        }
        let joints = plant.robot.joints;
        let limited = controller.saturated().iter().take(joints).filter(|&&limited| limited).count();
        self.sum_saturated += limited as f64 / joints as f64;
    }

    /// Checks whether a real arm would have stopped itself in the sample that was [added](Self::add) last. `qd` are the velocities of the
    /// joints of `arm` at the sample's end (rad/s), `contacts` the contact after each of the sample's parts.
    pub fn watch(&mut self, protection: &Protection, arm: &Arm, qd: &JointVector, contacts: &[ContactReading]) {
        let speed = speed_share(qd, arm);
        self.max_speed_share = self.max_speed_share.max(speed);
        let reason = contacts.iter().find_map(|contact| protection.stop(speed, contact));
        self.stop = self.stop.or(reason.map(|reason| Stop { time: self.time, reason }));
    }

    /// Adds the tool's motion in a sample of `dt` seconds; `velocity` is the one after it (m/s, world).
    pub(crate) fn follow(&mut self, motion: &mut Motion, velocity: Vector3, dt: f64) {
        self.displacement += velocity * dt;
        self.path += velocity.norm() * dt;
        if let Some(jerk) = motion.jerk(velocity, dt) {
            self.sum_jerk += jerk * dt;
            self.moving_time += dt;
        }
    }

    /// Mean translational stiffness (1/s2 or N/m: the action space's own unit).
    pub fn mean_own_stiffness(&self) -> f64 {
        self.sum_own_stiffness / f64::from(self.samples.max(1))
    }

    /// Mean torque of each joint (Nm).
    pub fn mean_torque(&self) -> JointVector {
        self.sum_torque / f64::from(self.samples.max(1))
    }

    /// The force of the hand or of the whole arm.
    pub fn force(&self, of: CountedForce) -> &ForceRecord {
        match of {
            CountedForce::Arm => &self.arm,
            CountedForce::Hand => &self.hand,
        }
    }

    /// Share of joint torques that were limited.
    pub fn saturated(&self) -> f64 {
        self.sum_saturated / f64::from(self.samples.max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aforce::{ControllerConfig, Jacobian, JointMatrix, Measurement, Pose, Twist, Vector3, Wrench};
    use physics::robots::RobotName;
    use physics::{Deviation, LinkReading, SimulationConfig};

    /// Seven joints of unit inertia, at rest; six of them move the tool along and about the world axes.
    fn arm() -> Measurement {
        Measurement {
            q: JointVector::zeros(),
            qd: JointVector::zeros(),
            pose: Pose::identity(),
            twist: Twist::zeros(),
            jacobian: Jacobian::identity(),
            mass: JointMatrix::identity(),
            bias: JointVector::zeros(),
            wrench: Wrench::zeros(),
        }
    }

    fn plant(dt: f64) -> Plant {
        let (config, deviation) = (SimulationConfig::default(), Deviation::default());
        Plant { robot: RobotName::default().robot(), dt, config, deviation }
    }

    /// A controller after one sample at its goal. It commands 1 Nm at each joint, and the first `limited` joints are limited to
    /// 0.5 Nm. `kp` commands the stiffness, -1 being 0 and 1 being 300.
    fn controller(kp: [f64; 6], limited: usize) -> Controller {
        let y = Measurement { bias: JointVector::repeat(1.0), ..arm() };
        let torque_max = std::array::from_fn(|i| if i < limited { 0.5 } else { 10.0 });
        let arm = Arm { torque_max, torque_rate_max: [f64::INFINITY; 7], ..Arm::PANDA };
        let space = "variable".parse().unwrap();
        let mut controller =
            Controller::new(&space, &ControllerConfig::default(), &arm, Vector3::z_axis()).expect("defaults");
        controller.reset(&y);
        controller.set_goal(&[kp, [0.0; 6]].concat(), &y);
        controller.update(&y);
        controller
    }

    /// The record of three samples of 2 ms, worked out by hand. The second sample has the extreme values.
    #[test]
    fn sums_means_and_extremes_are_over_all_samples() {
        const DT: f64 = 0.002;
        let penalty = ForcePenalty { limit: 15.0, of: CountedForce::Hand, ..ForcePenalty::default() };
        // Sustained forces of 10, 80 and 20 N; the moments must not count. In the third sample nothing touches, but the low-pass
        // still has a force.
        let contact = |x: f64, y: f64, z: f64, touching| {
            let sustained = Wrench::new(x, y, z, 500.0, 500.0, 500.0);
            let links = LinkReading { sustained: 7.0, raw: 30.0, touching: x > 0.0 };
            ContactReading {
                sustained,
                raw: 2.0 * sustained,
                touching,
                links,
                touching_itself: y < 0.0,
                ..ContactReading::default()
            }
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
            interval.add(&torques[k], &speeds[k], &contacts[k..=k], &controllers[k], &penalty, &plant(DT));
        }

        let close = |name: &str, a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{name}: {a}, not {b}");
        assert_eq!(interval.samples, 3);
        assert_eq!(
            interval.hand,
            ForceRecord { max: 80.0, impulse: interval.hand.impulse, last: 20.0, max_raw: 160.0 }
        );
        close("impulse", interval.hand.impulse, 110.0 * DT);
        // The links add 7 N to each sustained force, and 30 N to the unfiltered one.
        assert_eq!(interval.arm, ForceRecord { max: 87.0, impulse: interval.arm.impulse, last: 27.0, max_raw: 190.0 });
        close("impulse", interval.arm.impulse, 131.0 * DT);
        close("impulse above 15 N", interval.excess_impulse, (65.0 + 5.0) * DT);
        close("time of contact", interval.contact_time, 2.0 * DT);
        close("impulse while it touches", interval.contact_impulse, 90.0 * DT);
        close("above 20 N", interval.hard_time, DT);
        close("of the links", interval.link_contact_time, 2.0 * DT);
        close("of the arm with itself", interval.self_contact_time, DT);
        // Means over x, y, z: 150, 300 and 30.
        close("stiffness", interval.mean_own_stiffness(), 160.0);
        // At unit inertia 1/s2 are N/m. The bounds are 0 and 300. In the first sample one of x, y, z is at each bound,
        // in the second all three are at the upper one, in the third two are at the lower one.
        let [translation, rotation] = interval.impedance;
        close("stiffness that acts", translation.sum_stiffness, 480.0);
        close("at the lower bound", translation.sum_at_min, 1.0 / 3.0 + 2.0 / 3.0);
        close("at the upper bound", translation.sum_at_max, 1.0 / 3.0 + 1.0);
        close("rotation at the lower bound", rotation.sum_at_min, 1.0);
        close("rotation at the upper bound", rotation.sum_at_max, 1.0);
        close("no feed-forward", translation.sum_feedforward + rotation.sum_feedforward_spring, 0.0);
        close("saturated", interval.saturated(), (5.0 + 2.0) / 21.0);
        for i in 0..7 {
            let factor = (i + 1) as f64;
            close("torque", interval.mean_torque()[i], 2.0 * factor);
            close("work of a joint", interval.joint_work[i], (1.5 - 6.0) * factor * DT);
        }
        close("net energy", interval.energy.net, 28.0 * (1.5 - 6.0) * DT);
        close("absolute energy", interval.energy.absolute, 28.0 * (1.5 + 6.0) * DT);
    }

    /// The parts of the impedance of an arm that is held away from its goal, worked out by hand.
    #[test]
    fn each_group_of_axes_is_recorded_with_its_parts() {
        let mut y = arm();
        let limits = Arm { torque_max: [1e3; 7], torque_rate_max: [f64::INFINITY; 7], ..Arm::PANDA };
        let space = "aforce".parse().unwrap();
        let mut controller = Controller::new(&space, &ControllerConfig::default(), &limits, Vector3::z_axis()).unwrap();
        controller.reset(&y);
        y.pose = Pose::new(Vector3::new(0.03, 0.0, 0.04), Vector3::new(0.0, 0.1, 0.0));
        y.twist = Twist::new(0.0, 0.2, 0.0, 0.0, 0.0, 0.5);
        controller.update(&y);
        let mut interval = Interval::default();
        let still = JointVector::zeros();
        interval.add(
            &still,
            &still,
            &[ContactReading::default()],
            &controller,
            &ForcePenalty::default(),
            &plant(0.002),
        );
        let [translation, rotation] = interval.impedance;
        let close =
            |name: &str, a: f64, b: f64| assert!((a - b).abs() < 1e-9 * b.abs().max(1.0), "{name}: {a}, not {b}");
        let k = controller.stiffness();
        close("alpha / mu", translation.sum_feedforward_spring, 100.0);
        close("alpha / mu", rotation.sum_feedforward_spring, 5.0);
        close("K e", translation.sum_spring, f64::hypot(0.03 * k[0], 0.04 * k[2]));
        close("K e", rotation.sum_spring, 0.1 * k[4]);
        close("D e_dot", translation.sum_damper, 0.2 * 2.0 * k[1].sqrt());
        close("D e_dot", rotation.sum_damper, 0.5 * 2.0 * k[5].sqrt());
        // One sample: F_ff = dt alpha eps, eps = e + 0.05 s e_dot.
        close("F_ff", translation.sum_feedforward, 0.2 * Vector3::new(0.03, 0.01, 0.04).norm());
        let pull = translation.sum_feedforward + translation.sum_spring + translation.sum_damper;
        close("share of F_ff", translation.feedforward_share(), translation.sum_feedforward / pull);
        assert_eq!(AxisGroup::default().feedforward_share(), 0.0);
        close("work", translation.work, 0.002 * 0.2 * (0.2 * 2.0 * k[1].sqrt() + 0.2 * 0.01));
        assert_eq!((translation.sum_at_min, translation.sum_at_max), (0.0, 0.0));
    }

    /// Three samples of 2 ms: in the second a joint is too fast, in the third the hand is pushed too hard as well.
    #[test]
    fn the_first_reason_to_stop_is_kept_with_its_time() {
        const DT: f64 = 0.002;
        let controller = controller([0.0; 6], 0);
        let push = |newton: f64| ContactReading {
            sustained: Wrench::new(0.0, 0.0, newton, 0.0, 0.0, 0.0),
            ..ContactReading::default()
        };
        let mut interval = Interval::default();
        for (speed, newton) in [(2.0, 90.0), (-2.4, 10.0), (2.2, 110.0)] {
            let (qd, contacts) = (JointVector::repeat(speed), [push(newton)]);
            interval.add(&qd, &qd, &contacts, &controller, &ForcePenalty::default(), &plant(DT));
            interval.watch(&Protection::default(), &Arm::PANDA, &qd, &contacts);
        }
        assert_eq!(interval.stop, Some(Stop { time: 2.0 * DT, reason: StopReason::JointSpeed }));
        assert_eq!(interval.max_speed_share, 2.4 / 2.175, "joints 1 to 4 may turn at 2.175 rad/s");
    }

    /// A tool that goes to and fro in x and on in z is displaced in z alone. Its path counts both ways, its jerk while it moves.
    #[test]
    fn the_way_of_the_tool_is_summed() {
        const DT: f64 = 0.002;
        let (mut interval, mut motion) = (Interval::default(), Motion::default());
        for k in 0..100 {
            let x = if k < 50 { 0.1 } else { -0.1 };
            interval.follow(&mut motion, Vector3::new(x, 0.0, 0.05), DT);
        }
        assert!((interval.displacement - Vector3::z() * 0.01).norm() < 1e-12);
        assert!((interval.path - 0.2 * f64::hypot(0.1, 0.05)).abs() < 1e-12);
        assert!((interval.moving_time - 86.0 * DT).abs() < 1e-12, "14 samples are not told");
        assert!(interval.sum_jerk > 0.0);
    }

    /// An arm of six joints has no seventh whose torque could be cut.
    #[test]
    fn the_saturated_share_is_of_the_joints_that_the_arm_has() {
        for (robot, joints) in [(RobotName::Robosuite, 7.0), (RobotName::Ur5e, 6.0)] {
            let plant = Plant { robot: robot.robot(), ..plant(0.002) };
            let (torque, at_rest, penalty) = (JointVector::zeros(), JointVector::zeros(), ForcePenalty::default());
            for (limited, counted) in [(3, 3.0), (7, joints)] {
                let mut interval = Interval::default();
                let contacts = [ContactReading::default()];
                interval.add(&torque, &at_rest, &contacts, &controller([0.0; 6], limited), &penalty, &plant);
                assert_eq!(interval.saturated(), counted / joints, "{robot}, {limited}");
            }
        }
    }

    /// The means of an action that diverged in its first sample are 0, not NaN.
    #[test]
    fn means_over_no_sample_are_zero() {
        let interval = Interval::default();
        assert_eq!((interval.mean_own_stiffness(), interval.saturated()), (0.0, 0.0));
        assert_eq!(interval.mean_torque(), JointVector::zeros());
    }
}
