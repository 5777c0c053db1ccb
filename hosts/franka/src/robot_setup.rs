//! The robot's own settings: the table `robot` of a set-up, which only this host reads.

use aforce::host::pose_from_matrix;
use aforce::record;
use anyhow::{Result, ensure};
use franka::Robot;
use nalgebra::Matrix3;
use serde::Deserialize;

use crate::gripper::GripperSetup;

/// Largest collision threshold that a set-up may have (N, Nm).
pub const COLLISION_MAX: f64 = 100.0;
const COLLISION_MARGIN: f64 = 1.5;
/// Largest payload of a Panda and of an FR3 (kg), and how far from the flange a tool or a payload may be (m).
const PAYLOAD: f64 = 3.0;
const REACH: f64 = 1.0;

/// Settings that are sent to the robot before a motion.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotSetup {
    /// External torque of each joint (Nm) at which the robot itself stops; by default that of Franka's examples.
    pub collision_torque: [f64; 7],
    /// External force and moment (N, Nm; base axes) at which the robot itself stops; by default 1.5 times `limits.external_max`, at most 100.
    pub collision_force: Option<[f64; 6]>,
    /// Payload at the flange beside the end effector that is configured in Franka's Desk; if absent, Desk's payload stays.
    pub load: Option<Load>,
    /// The tool point's frame in the nominal end-effector frame: 4 x 4, column-major (m); if absent, Desk's frame stays.
    pub tool: Option<[f64; 16]>,
    /// The hand, if the host is to move it.
    pub gripper: Option<GripperSetup>,
}

/// A payload.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass in the flange's frame (m).
    pub centre: [f64; 3],
    /// Inertia about the centre of mass: 3 x 3, column-major (kg m^2).
    pub inertia: [f64; 9],
}

impl Load {
    fn validate(&self) -> Result<()> {
        ensure!(
            (0.0..=PAYLOAD).contains(&self.mass),
            "robot.load.mass = {} is not allowed; allowed: 0 to {PAYLOAD}",
            self.mass
        );
        ensure!(
            self.centre.iter().all(|way| way.abs() <= REACH),
            "robot.load.centre = {:?} is not allowed; allowed: up to {REACH} m either way",
            self.centre
        );
        // Of the principal moments of inertia of a body none is larger than the sum of the two others.
        let inertia = Matrix3::from_column_slice(&self.inertia);
        let is_symmetric = (inertia - inertia.transpose()).amax() <= 1e-9 && inertia.iter().all(|x| x.is_finite());
        let is_bodys = is_symmetric && {
            let moments = inertia.symmetric_eigenvalues();
            2.0 * moments.max() <= moments.sum() + 1e-9
        };
        ensure!(is_bodys, "robot.load.inertia = {:?}: no body has it", self.inertia);
        Ok(())
    }
}

impl Default for RobotSetup {
    fn default() -> Self {
        let collision_torque = [20.0, 20.0, 18.0, 18.0, 16.0, 14.0, 12.0];
        Self { collision_torque, collision_force: None, load: None, tool: None, gripper: None }
    }
}

impl RobotSetup {
    /// Splits the table `robot` from a set-up. Empty lines take its place, so that the other lines keep their numbers in messages.
    pub fn cut_out(text: &str) -> Result<(Self, String)> {
        let (mut own, mut rest, mut inside) = (String::new(), String::new(), false);
        for line in text.lines() {
            if let Some(header) = line.trim_start().strip_prefix('[') {
                inside = header.starts_with("robot]") || header.starts_with("robot.");
            }
            let (taken, left) = if inside { (line, "") } else { ("", line) };
            own += taken;
            own.push('\n');
            rest += left;
            rest.push('\n');
        }
        #[derive(Deserialize)]
        struct File {
            #[serde(default)]
            robot: RobotSetup,
        }
        let File { robot } = record::parse(&own)?;
        robot.validate()?;
        Ok((robot, rest))
    }

    fn validate(&self) -> Result<()> {
        for (joint, torque) in self.collision_torque.iter().enumerate() {
            ensure!(
                (1.0..=COLLISION_MAX).contains(torque),
                "robot.collision_torque (joint {}) = {torque} is not allowed; allowed: 1 to {COLLISION_MAX}",
                joint + 1
            );
        }
        for force in self.collision_force.iter().flatten() {
            ensure!(
                (1.0..=COLLISION_MAX).contains(force),
                "robot.collision_force = {force} is not allowed; allowed: 1 to {COLLISION_MAX}"
            );
        }
        if let Some(tool) = &self.tool {
            let pose = pose_from_matrix(tool);
            let is_rigid = pose.rotation.coords.iter().all(|x| x.is_finite())
                && tool[3..16].iter().step_by(4).eq([&0.0, &0.0, &0.0, &1.0]);
            ensure!(
                is_rigid && pose.translation.vector.amax() <= REACH,
                "robot.tool is no turn with a way of {REACH} m at most; right would be 16 numbers, column by column, the last the way and 1"
            );
        }
        self.load.as_ref().map_or(Ok(()), Load::validate)?;
        self.gripper.as_ref().map_or(Ok(()), GripperSetup::validate)
    }

    /// Sends the settings to the robot. `external_max` is the external force and moment that is a fault of the host (N, Nm).
    pub fn apply(&self, robot: &Robot, external_max: [f64; 2]) -> Result<()> {
        let [force, moment] = external_max.map(|max| (COLLISION_MARGIN * max).min(COLLISION_MAX));
        let forces = self.collision_force.unwrap_or([force, force, force, moment, moment, moment]);
        robot.set_collision_behavior_simple(self.collision_torque, self.collision_torque, forces, forces)?;
        if let Some(tool) = self.tool {
            robot.set_ee(tool)?;
        }
        if let Some(load) = &self.load {
            robot.set_load(load.mass, load.centre, load.inertia)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_robots_table_is_cut_out_and_the_lines_stay() {
        let text = "arm = 'fr3'\n[robot]\ncollision_torque = [30, 30, 30, 30, 12, 12, 12]\n[robot.load]\nmass = 0.5\ncentre = [0, 0, 0.1]\n\
                    inertia = [1e-3, 0, 0, 0, 1e-3, 0, 0, 0, 1e-3]\n[limits]\njoint_margin = 0.2";
        let (robot, rest) = RobotSetup::cut_out(text).unwrap();
        assert_eq!((robot.collision_torque[0], robot.load.unwrap().mass), (30.0, 0.5));
        assert_eq!(
            rest.lines().map(str::trim).collect::<Vec<_>>(),
            ["arm = 'fr3'", "", "", "", "", "", "", "[limits]", "joint_margin = 0.2"]
        );
        assert_eq!(RobotSetup::cut_out("arm = 'fr3'").unwrap().0, RobotSetup::default());
    }

    #[test]
    fn what_is_wrong_is_told() {
        let error = |text: &str| RobotSetup::cut_out(text).unwrap_err().to_string();
        assert!(
            error("[robot]\ncollision_torque = [300, 1, 1, 1, 1, 1, 1]")
                .starts_with("robot.collision_torque (joint 1) = 300")
        );
        assert!(error("\n[robot]\npayload = 1").starts_with("line 3, column 1: unknown key \"robot.payload\""));
        let heavy = "[robot.load]\nmass = 30\ncentre = [0, 0, 0]\ninertia = [0, 0, 0, 0, 0, 0, 0, 0, 0]";
        assert_eq!(error(heavy), "robot.load.mass = 30 is not allowed; allowed: 0 to 3");
        let load = |centre: &str, inertia: &str| {
            error(&format!("[robot.load]\nmass = 1\ncentre = [0, 0, {centre}]\ninertia = [{inertia}]"))
        };
        assert!(load("3", "0, 0, 0, 0, 0, 0, 0, 0, 0").starts_with("robot.load.centre = [0.0, 0.0, 3.0] is not"));
        for inertia in ["1, 0, 0, 0, 1, 0, 0, 0, 3", "1, 0.5, 0, 0, 1, 0, 0, 0, 1", "nan, 0, 0, 0, 1, 0, 0, 0, 1"] {
            assert!(load("0", inertia).ends_with("no body has it"), "{inertia}");
        }
        for tool in
            ["2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1", "1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.1, 0, 0, 0, 1"]
        {
            assert!(error(&format!("[robot]\ntool = [{tool}]")).starts_with("robot.tool is no turn"), "{tool}");
        }
    }
}
