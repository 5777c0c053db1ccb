//! Forces of the air on the bodies.

use aforce::Vector3;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion};
use rapier3d_f64::dynamics::RigidBodyHandle;

use super::Engine;
use super::convert::{coordinates, vector};
use crate::air::Drag;
use crate::scene::{Joint, Scene};

/// A moving body and its drags.
pub(super) struct Mover {
    body: RigidBodyHandle,
    /// Index of the joint that moves the body (`None`: it moves freely), and of the mover that carries that joint, if
    /// any.
    joint: Option<usize>,
    carrier: Option<usize>,
    drags: Vec<Drag>,
    // Work space of a step, in world axes.
    rotation: Matrix3<f64>,
    origin: Vector3,
    /// Direction of the joint.
    axis: Vector3,
    /// Velocity of the origin (m/s), and angular velocity (rad/s).
    velocity: [Vector3; 2],
    /// Force (N), and moment about the origin (Nm), that the air exerts on the body and all that it carries.
    load: [Vector3; 2],
}

impl Engine {
    /// All bodies that move through the air, carriers first; none without air. To be called when all bodies have been added.
    pub(super) fn movers(&self, scene: &Scene) -> Vec<Mover> {
        let moving = (0..scene.bodies.len()).filter(|&index| scene.air.is_some() && self.bodies[index].is_some());
        let moving: Vec<usize> = moving.collect();
        let mut joints = 0..;
        let mover = |&index: &usize| {
            let carrier = scene.bodies[index].parent.and_then(|parent| scene.moving_root(parent).0);
            Mover {
                body: self.bodies[index].expect("a moving body"),
                joint: (scene.bodies[index].joint != Joint::Free).then(|| joints.next().expect("endless")),
                carrier: carrier.and_then(|carrier| moving.iter().position(|&index| index == carrier)),
                drags: scene.drags(index),
                rotation: Matrix3::identity(),
                origin: Vector3::zeros(),
                axis: Vector3::zeros(),
                velocity: Default::default(),
                load: Default::default(),
            }
        };
        moving.iter().map(mover).collect()
    }

    /// Updates poses and velocities of the movers and sets their loads to zero. For bodies on joints, and for bodies that
    /// carry joints, the engine's own velocities are a step old.
    fn update_movers(&mut self) {
        for i in 0..self.movers.len() {
            let Mover { body, joint, carrier, .. } = self.movers[i];
            let mut axis = Vector3::zeros();
            let pose = self.world.bodies[body].position();
            let (position, q) = (coordinates(pose.translation), pose.rotation);
            let rotation = UnitQuaternion::new_unchecked(Quaternion::new(q.w, q.x, q.y, q.z)).to_rotation_matrix();
            let velocity = match joint {
                None => {
                    let [at, v, omega] = self.free_motion(body);
                    [v + omega.cross(&(position - at)), omega]
                }
                Some(joint) => {
                    let mut velocity = carrier.map_or(Default::default(), |carrier| {
                        let Mover { origin, velocity: [v, omega], .. } = &self.movers[carrier];
                        [v + omega.cross(&(position - origin)), *omega]
                    });
                    axis = rotation * self.joints[joint].direction;
                    velocity[self.joints[joint].part()] += axis * self.coordinate(joint).1;
                    velocity
                }
            };
            let mover = &mut self.movers[i];
            (mover.rotation, mover.origin) = (rotation.into_inner(), position);
            (mover.axis, mover.velocity, mover.load) = (axis, velocity, Default::default());
        }
    }

    /// Adds the drag at the present velocities: to `efforts` (Nm or N) for bodies that joints carry, as an external force
    /// for free bodies.
    pub fn add_drag(&mut self, efforts: &mut [f64]) {
        self.update_movers();
        for i in (0..self.movers.len()).rev() {
            let (carriers, mover) = self.movers.split_at_mut(i);
            let mover = &mut mover[0];
            mover.add_own_load();
            let [force, moment] = mover.load;
            if let Some(joint) = mover.joint {
                efforts[joint] += mover.axis.dot(&mover.load[self.joints[joint].part()]);
                if let Some(carrier) = mover.carrier {
                    let carrier = &mut carriers[carrier];
                    carrier.load[0] += force;
                    carrier.load[1] += moment + (mover.origin - carrier.origin).cross(&force);
                }
            } else {
                let body = &mut self.world.bodies[mover.body];
                body.reset_forces(false);
                body.reset_torques(false);
                body.add_force_at_point(vector(&force), vector(&mover.origin), true);
                body.add_torque(vector(&moment), true);
            }
        }
    }
}

impl Mover {
    /// Adds the drag on this body to the load of the bodies that it carries.
    fn add_own_load(&mut self) {
        let velocity = self.velocity.map(|part| self.rotation.tr_mul(&part));
        let mut load = [Vector3::zeros(); 2];
        for drag in &self.drags {
            let [force, moment] = drag.load(velocity);
            load[0] += force;
            load[1] += moment;
        }
        self.load[0] += self.rotation * load[0];
        self.load[1] += self.rotation * load[1];
    }
}

#[cfg(test)]
mod tests {
    use aforce::Vector3;

    use super::Engine;
    use crate::robots::RobotName;
    use crate::scene::Scene;
    use crate::scenes::{door, lift, wipe};

    /// Torque of the air on each of the first nine joints (zero where there are fewer) at `q`, moving with `qd`.
    fn torques(scene: &Scene, q: &[f64], qd: &[f64]) -> Vec<f64> {
        let mut engine = Engine::new(scene, 0.002, 1);
        let joints = engine.axes().len();
        for i in 0..joints.min(9) {
            engine.set_coordinate(i, q[i], qd[i]);
        }
        engine.settle();
        let mut efforts = vec![0.0; joints];
        engine.add_drag(&mut efforts);
        efforts.resize(9, 0.0);
        efforts
    }

    /// The torques are robosuite's with its own models, and MuJoCo's with the MJCF export of this crate's scenes.
    #[test]
    fn air_brakes_the_joints_as_in_mujoco() {
        let robot = RobotName::Robosuite.robot();
        let references = [include_str!("../../reference/robosuite_air.csv"), include_str!("../../reference/air.csv")];
        for (reference, rows) in references.iter().zip([20, 30]) {
            let lines: Vec<&str> = reference.lines().skip(2).collect();
            assert_eq!(lines.len(), rows);
            for line in lines {
                let (task, numbers) = line.split_once(',').unwrap();
                let numbers: Vec<f64> = numbers.split(',').map(|cell| cell.parse().unwrap()).collect();
                let scene = match task {
                    "lift" => lift::scene(&robot, Vector3::repeat(0.021)).0,
                    "door" => door::scene(&robot, &door::root(door::MIDDLE)).0,
                    "wipe" => wipe::scene(&robot, wipe::TABLE_HEIGHT, wipe::TABLE_FRICTION).0,
                    _ => panic!("{task}"),
                };
                let (q, qd, expected) = (&numbers[..9], &numbers[9..18], &numbers[18..]);
                let largest = expected.iter().fold(0.0, |most: f64, tau| most.max(tau.abs()));
                assert!(largest > 0.1, "{line}");
                for (tau, expected) in torques(&scene, q, qd).iter().zip(expected) {
                    let error = (tau - expected).abs() / largest;
                    assert!(error < 1e-7, "{line}\nis off by {error} of the largest torque");
                }
            }
        }
    }

    #[test]
    fn the_identified_arm_moves_through_nothing() {
        let scene = lift::scene(&RobotName::Identified.robot(), Vector3::repeat(0.021)).0;
        assert!(Engine::new(&scene, 0.002, 1).movers.is_empty());
    }
}
