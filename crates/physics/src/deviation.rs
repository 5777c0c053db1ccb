//! How the simulated plant deviates from the controller's model.

use aforce::Vector3;

use crate::scene::{Body, Inertial, Joint, Scene, at};

/// Deviations of the simulated plant. The controller's model is made from the scene without them.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    /// Point mass at the controlled point, fixed to hand or tool (kg).
    pub payload: f64,
    /// Factor on every coefficient of sliding friction.
    pub friction: f64,
    /// Factor on mass and inertia of every body with a free joint. Bodies that are fixed to it keep theirs.
    pub object_mass: f64,
    /// Factor on viscous damping and dry friction of the joint `hinge`.
    pub hinge_damping: f64,
    /// Stiffness that is added to the joint `hinge`, at rest when it is closed (Nm/rad).
    pub hinge_spring: f64,
    /// Distance by which the shapes of the body `table` are raised (m).
    pub table_height: f64,
    /// Changes of bodies and joints by name, each with its value.
    pub own: Vec<(Change, f64)>,
}

/// A change of one body or joint. Its value is a factor, except for a spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    /// Mass and inertia of the body of this name.
    BodyMass(&'static str),
    /// Sliding friction of the shapes of the body of this name.
    BodyFriction(&'static str),
    /// Dry friction of the joint of this name.
    JointFriction(&'static str),
    /// Viscous damping of the joint of this name.
    JointDamping(&'static str),
    /// Stiffness (Nm/rad or N/m) added to the joint of this name, at rest at zero.
    JointSpring(&'static str),
}

impl Change {
    /// Unit of the change's value.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Change::JointSpring(_) => "Nm/rad or N/m",
            Change::BodyMass(_) | Change::BodyFriction(_) | Change::JointFriction(_) | Change::JointDamping(_) => "1",
        }
    }

    /// Whether `value` is allowed: finite, above 0 for a mass and at least 0 for anything else.
    #[must_use]
    pub fn is_possible(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Change::BodyMass(_) => value > 0.0,
                Change::BodyFriction(_)
                | Change::JointFriction(_)
                | Change::JointDamping(_)
                | Change::JointSpring(_) => value >= 0.0,
            }
    }

    /// Makes the change in `scene`.
    ///
    /// # Panics
    /// If the scene has no body or joint of this name.
    fn apply(self, value: f64, scene: &mut Scene) {
        match self {
            Change::BodyMass(name) => {
                let body = scene.body(name);
                scene.bodies[body].inertial.mass *= value;
                scene.bodies[body].inertial.inertia *= value;
            }
            Change::BodyFriction(name) => {
                let body = scene.body(name);
                scene.bodies[body].geoms.iter_mut().for_each(|geom| geom.friction *= value);
            }
            Change::JointFriction(name) => scene.axis_mut(name).friction *= value,
            Change::JointDamping(name) => scene.axis_mut(name).damping *= value,
            Change::JointSpring(name) => scene.axis_mut(name).add_spring(value),
        }
    }
}

impl Default for Deviation {
    /// No deviation.
    fn default() -> Self {
        Deviation {
            payload: 0.0,
            friction: 1.0,
            object_mass: 1.0,
            hinge_damping: 1.0,
            hinge_spring: 0.0,
            table_height: 0.0,
            own: vec![],
        }
    }
}

impl Deviation {
    /// The scene as it is simulated; the payload sits at `offset` in the body `tool`.
    pub(crate) fn of(&self, scene: &Scene, tool: usize, offset: [f64; 3]) -> Scene {
        let mut scene = scene.clone();
        if self.payload > 0.0 {
            scene.add(Body {
                name: "payload".into(),
                parent: Some(tool),
                pose: at(offset),
                joint: Joint::Fixed,
                inertial: Inertial::diagonal(self.payload, [0.0; 3], [0.0; 3]),
                geoms: vec![],
            });
        }
        for body in &mut scene.bodies {
            for geom in &mut body.geoms {
                geom.friction *= self.friction;
                if body.name == "table" {
                    geom.pose.translation.vector += self.table_height * Vector3::z();
                }
            }
            match &mut body.joint {
                Joint::Free => {
                    body.inertial.mass *= self.object_mass;
                    body.inertial.inertia *= self.object_mass;
                }
                Joint::Hinge(axis) if axis.name == "hinge" => {
                    axis.damping *= self.hinge_damping;
                    axis.friction *= self.hinge_damping;
                    axis.add_spring(self.hinge_spring);
                }
                _ => {}
            }
        }
        self.own.iter().for_each(|(change, value)| change.apply(*value, &mut scene));
        scene
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robots::RobotName;
    use crate::scenes::{door, insert, lift, wipe};

    /// The added spring alone would rest at zero: the two together rest where their efforts cancel.
    #[test]
    fn a_spring_is_added_at_rest_at_zero() {
        let (mut scene, _) = door::scene(&RobotName::Robosuite.robot(), &door::root(door::MIDDLE));
        let hinge = scene.axis_mut("hinge");
        (hinge.spring, hinge.rest) = (10.0, 0.3);
        Change::JointSpring("hinge").apply(10.0, &mut scene);
        let hinge = scene.axis_mut("hinge");
        assert_eq!((hinge.spring, hinge.rest), (20.0, 0.15));
    }

    /// Every shape is checked: a contact has the larger friction of its two shapes, so that one left out would show in some contacts only.
    #[test]
    fn friction_is_multiplied_on_every_shape_of_every_scene() {
        let robot = RobotName::Robosuite.robot();
        let frictions = |scene: &Scene| -> Vec<f64> {
            scene.bodies.iter().flat_map(|body| &body.geoms).map(|geom| geom.friction).collect()
        };
        for (scene, tool) in [
            lift::scene(&robot, Vector3::repeat(0.021)),
            door::scene(&robot, &door::root(door::MIDDLE)),
            wipe::scene(&robot, wipe::TABLE_HEIGHT, wipe::TABLE_FRICTION),
            insert::scene(&robot, &insert::FORGE, [0.0; 2]),
        ] {
            let multiplied =
                |friction| frictions(&Deviation { friction, ..Deviation::default() }.of(&scene, tool, [0.0; 3]));
            let own = frictions(&scene);
            assert_eq!(multiplied(1.0), own);
            assert_eq!(multiplied(3.0), own.iter().map(|friction| 3.0 * friction).collect::<Vec<_>>());
        }
    }
}
