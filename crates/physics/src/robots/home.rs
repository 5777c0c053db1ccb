//! Finds joint angles for the start of an episode, for an arm whose file gives none.

use aforce::{JointVector, Pose, pose_error};

use super::{JOINTS, Robot, panda};
use crate::model::Model;
use crate::scene::{Scene, at};

/// Number of postures from which a search starts.
const STARTS: u32 = 1024;
/// Largest number of steps of a search.
const STEPS: usize = 100;
/// Damping of a step (m2, rad2), small enough to matter near a singular posture only.
const DAMPING: f64 = 1e-4;
/// Distance from the ends of a joint, as a share of its range, beyond which a posture is no better.
const ROOM: f64 = 0.06;
/// Manipulability beyond which a posture is no better (m3): the Panda's home has 0.019.
const MANIPULABILITY: f64 = 0.019;
/// Norm of the pose error at which a search ends (m, rad).
const PRECISION: f64 = 1e-10;

impl Robot {
    /// Joint angles (rad) that bring the flange where the Panda's is at the start of an episode: above the table, facing down. Of the
    /// postures found, the one with the highest links, well within the joints' ranges and far from singular. `None`: the arm does not
    /// reach that pose.
    pub(super) fn home_like_the_pandas(&self) -> Option<JointVector> {
        let panda = panda::robosuite();
        let shift = [self.mount.behind_table - panda.mount.behind_table, 0.0, panda.mount.height - self.mount.height];
        let model = panda.bare_model();
        let goal = at(shift) * model.kinematics(&panda.home).tool;
        let model = self.bare_model();
        let found = (0..STARTS).filter_map(|start| self.reach(&model, &goal, self.spread(start)));
        found.max_by(|a, b| self.worth(&model, a).total_cmp(&self.worth(&model, b)))
    }

    /// Model of the arm at the world's origin, with the flange as its tool.
    fn bare_model(&self) -> Model {
        let mut scene = Scene::default();
        let flange = self.add_to(&mut scene, Pose::identity());
        Model::new(&scene, flange, [0.0; 3])
    }

    /// Lower and upper end of a joint (rad), as far as the range allows within half a turn of zero.
    fn ends(&self, joint: usize) -> [f64; 2] {
        let [low, high] = self.arm.range[joint];
        let half_turn = std::f64::consts::PI;
        [low.max(-half_turn).min(high), high.min(half_turn).max(low)]
    }

    /// The posture (rad) from which search number `start` begins.
    fn spread(&self, start: u32) -> JointVector {
        JointVector::from_fn(|i, _| {
            let [low, high] = self.ends(i);
            // Some joints begin at zero, which keeps an arm in its plane of symmetry.
            if start >> i & 1 == 0 { 0.0_f64.clamp(low, high) } else { low + (high - low) * share(start, i) }
        })
    }

    /// Joint angles (rad) near `q` at which the tool of `model`, a model of this robot, stands at `goal` (world). `None`: none was
    /// found by damped least squares within the joints' ranges.
    pub fn reach(&self, model: &Model, goal: &Pose, mut q: JointVector) -> Option<JointVector> {
        for _ in 0..STEPS {
            let k = model.kinematics(&q);
            let error = pose_error(goal, &k.tool);
            if error.norm() < PRECISION {
                return Some(q);
            }
            let jacobian = model.jacobian(&k);
            let normal =
                jacobian * jacobian.transpose() + nalgebra::Matrix6::identity() * DAMPING * error.norm().min(1.0);
            q += jacobian.tr_mul(&normal.cholesky()?.solve(&error));
            q = JointVector::from_fn(|i, _| {
                let [low, high] = self.ends(i);
                if i < self.joints { q[i].clamp(low, high) } else { 0.0 }
            });
        }
        None
    }

    /// How good a posture is to start from: the summed height of the links, scaled down near the end of a joint and
    /// near a singular posture.
    fn worth(&self, model: &Model, q: &JointVector) -> f64 {
        let k = model.kinematics(q);
        let jacobian = model.jacobian(&k);
        let manipulability = (jacobian * jacobian.transpose()).determinant().max(0.0).sqrt();
        let room = (0..self.joints).map(|i| {
            let [low, high] = self.arm.range[i];
            (q[i] - low).min(high - q[i]) / (high - low)
        });
        let height = k.links.iter().map(|link| link.translation.z).sum::<f64>().max(0.0);
        height * room.fold(ROOM, f64::min) * manipulability.min(MANIPULABILITY)
    }
}

/// Shares in [0, 1) that fill the space of joint angles evenly: for each joint the fractional part of the multiples of
/// another power of one irrational number.
fn share(start: u32, joint: usize) -> f64 {
    // The root of x^8 = x + 1, for seven joints.
    const ROOT: f64 = 1.0969815577985598;
    debug_assert!(joint < JOINTS);
    let step = libm::pow(ROOT, -(joint as f64 + 1.0));
    (0.5 + f64::from(start) * step).fract()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robots::RobotName;

    /// The search finds the Panda's own home. For every robot it finds a home at which the flange is where the robot's own home has it.
    #[test]
    fn a_home_is_found_with_the_elbow_up() {
        let panda = RobotName::Identified.robot();
        let found = panda.home_like_the_pandas().unwrap();
        assert!((found - panda.home).amax() < 0.01, "{found}");
        let flange = |robot: &Robot, q: &JointVector| robot.bare_model().kinematics(q).tool;
        for robot in RobotName::ALL.map(RobotName::robot) {
            let found = robot.home_like_the_pandas().unwrap();
            let error = pose_error(&flange(&robot, &found), &flange(&robot, &robot.home));
            assert!(error.amax() < 1e-3, "{}: {error}", robot.name);
        }
    }

    #[test]
    fn an_arm_that_is_too_far_away_has_no_home() {
        let mut robot = RobotName::Identified.robot();
        robot.mount.behind_table += 1.0;
        assert_eq!(robot.home_like_the_pandas(), None);
    }
}
