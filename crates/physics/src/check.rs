//! What a scene has to fulfil before it is simulated.

use std::collections::HashSet;

use aforce::Pose;
use nalgebra::Point3;
use thiserror::Error;

use crate::engine::ground_below;
use crate::scene::{Axis, Body, Geom, Inertial, Joint, Role, Scene, Stop, inertial};

/// What is wrong with a scene, in one line.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SceneError {
    /// A body, or one of its joints or geoms.
    #[error("body {body:?}: {why}")]
    Body {
        /// Its name.
        body: String,
        /// What is wrong, and what would be right.
        why: String,
    },
    /// A value of the scene itself.
    #[error("scene: {0}")]
    Scene(String),
}

impl Scene {
    /// Checks that the scene can be simulated: names are unique, parents stand before their children and the arm before all
    /// other joints, everything that moves has mass, free bodies have something below them, and every number is finite
    /// and in its range. Whether geoms overlap depends on where the joints are: [`crate::Simulation::overlaps`].
    ///
    /// # Errors
    /// The first thing that is wrong, with the name of its body.
    pub fn check(&self) -> Result<(), SceneError> {
        let mut names = [HashSet::new(), HashSet::new(), HashSet::new()];
        let mut object_moves = false;
        for (index, body) in self.bodies.iter().enumerate() {
            let wrong = |why: String| SceneError::Body { body: body.name.clone(), why };
            let joint = match &body.joint {
                Joint::Hinge(axis) | Joint::Slide(axis) => Some(("joint", axis.name.as_str())),
                Joint::Free | Joint::Fixed => None,
            };
            let geoms = body.geoms.iter().map(|geom| ("geom", geom.name.as_str()));
            for (kind, name) in [("body", body.name.as_str())].into_iter().chain(joint).chain(geoms) {
                let known = &mut names[["body", "joint", "geom"].iter().position(|&k| k == kind).expect("listed")];
                if name.is_empty() {
                    return Err(wrong(format!("a {kind} has no name")));
                }
                if !known.insert(name) {
                    return Err(wrong(format!("the name {name:?} is that of two {}", plural(kind))));
                }
            }
            if body.parent.is_some_and(|parent| parent >= index) {
                return Err(wrong("its parent has to stand before it among the bodies".into()));
            }
            body.check().map_err(wrong)?;
            if joint.is_some() {
                let is_link = (1..=7).any(|number| body.name == format!("link{number}"));
                let is_arm = is_link || self.is_arm_joint(index);
                if is_arm && object_moves {
                    return Err(wrong("an arm's joints have to stand before those of all objects".into()));
                }
                object_moves |= !is_arm;
                let stop = match &body.joint {
                    Joint::Hinge(axis) | Joint::Slide(axis) => Some(axis.stop),
                    Joint::Free | Joint::Fixed => None,
                };
                if stop == Some(Stop::Constraint) && !is_link {
                    return Err(wrong(
                        "its end stop is a constraint, which the arm's links alone may have; take a spring".into(),
                    ));
                }
            }
            self.check_matter(index).map_err(wrong)?;
        }
        self.check_values(&names[1])
    }

    /// Checks that a moving body has mass, and that a free body has ground below it.
    fn check_matter(&self, index: usize) -> Result<(), String> {
        let body = &self.bodies[index];
        let matter = self.merged_inertial(index);
        match &body.joint {
            Joint::Fixed => Ok(()),
            Joint::Free => {
                if body.parent.is_some() {
                    return Err("a free body is a child of the world".into());
                }
                if matter.mass <= 0.0 || !is_solid(&matter) {
                    return Err(format!(
                        "it is free and has a mass of {} kg; mass and all three moments of inertia must be above 0",
                        matter.mass
                    ));
                }
                let centre = (body.pose * Point3::from(matter.com)).coords;
                if !ground_below(self, &centre) {
                    return Err("it is free and nothing that stands still is below it: it would fall for ever".into());
                }
                Ok(())
            }
            Joint::Hinge(axis) | Joint::Slide(axis) if axis.armature == 0.0 => {
                let inert = match &body.joint {
                    Joint::Slide(_) => matter.mass,
                    _ => matter.about(&axis.direction),
                };
                if inert <= 0.0 {
                    return Err(format!(
                        "joint {:?} moves a body without mass; give it an inertial, or the joint an armature",
                        axis.name
                    ));
                }
                Ok(())
            }
            Joint::Hinge(_) | Joint::Slide(_) => Ok(()),
        }
    }

    fn check_values(&self, joints: &HashSet<&str>) -> Result<(), SceneError> {
        let wrong = |why: String| Err(SceneError::Scene(why));
        for actuator in &self.actuators {
            if !joints.contains(actuator.joint.as_str()) {
                return wrong(format!("an actuator drives joint {:?}, which is not there", actuator.joint));
            }
            at_least_0(&format!("effort of the actuator of {:?}", actuator.joint), actuator.max_effort)
                .map_err(SceneError::Scene)?;
        }
        if let Some(prediction) = self.prediction.filter(|&distance| !(distance > 0.0 && distance.is_finite())) {
            return wrong(format!("a prediction distance of {prediction} m; it must be finite and above 0"));
        }
        if let Some(pad) = &self.pad {
            let geoms: usize = self.bodies.iter().map(|body| body.geoms.len()).sum();
            if pad.surface >= geoms {
                return wrong(format!("the pad meets geom {} of {geoms}", pad.surface));
            }
            for (what, value) in [("stiffness", pad.stiffness), ("damping", pad.damping), ("travel", pad.travel)] {
                at_least_0(&format!("{what} of the pad"), value).map_err(SceneError::Scene)?;
            }
        }
        if let Some(air) = &self.air {
            for (what, value) in [("density", air.density), ("viscosity", air.viscosity)] {
                at_least_0(&format!("{what} of the air"), value).map_err(SceneError::Scene)?;
            }
        }
        Ok(())
    }
}

impl Body {
    /// Checks the numbers of one body.
    fn check(&self) -> Result<(), String> {
        finite_pose("its pose", &self.pose)?;
        let Inertial { mass, com, inertia } = &self.inertial;
        at_least_0("its mass", *mass)?;
        if !com.iter().all(|x| x.is_finite()) {
            return Err("its centre of mass is not finite".into());
        }
        if let Some(why) = inertial::impossible(inertia) {
            return Err(why);
        }
        match &self.joint {
            Joint::Hinge(axis) | Joint::Slide(axis) => {
                axis.check().map_err(|why| format!("joint {:?}: {why}", axis.name))?
            }
            Joint::Fixed | Joint::Free => {}
        }
        self.geoms.iter().try_for_each(|geom| geom.check().map_err(|why| format!("geom {:?}: {why}", geom.name)))
    }
}

impl Axis {
    fn check(&self) -> Result<(), String> {
        let [low, high] = self.range;
        let endless = [low, high] == [f64::NEG_INFINITY, f64::INFINITY];
        if !(endless || low.is_finite() && high.is_finite() && low <= high) {
            return Err(format!("the range [{low}, {high}]; both ends must be finite and in order, or both infinite"));
        }
        if !self.rest.is_finite() || !self.direction.iter().all(|x| x.is_finite()) {
            return Err("its direction or the rest of its spring is not finite".into());
        }
        let stop = match self.stop {
            Stop::Spring { stiffness, damping } => [stiffness, damping],
            Stop::Constraint => [0.0; 2],
        };
        let values = [self.damping, self.friction, self.armature, self.spring, stop[0], stop[1]];
        let names = ["damping", "dry friction", "armature", "spring", "stiffness of the stop", "damping of the stop"];
        names.iter().zip(values).try_for_each(|(what, value)| at_least_0(what, value))
    }
}

impl Geom {
    fn check(&self) -> Result<(), String> {
        finite_pose("its pose", &self.pose)?;
        at_least_0("friction", self.friction)?;
        if matches!(self.role, Role::Link(link) if !(1..=7).contains(&link)) {
            return Err(format!("{:?}; an arm has links 1 to 7", self.role));
        }
        match self.shape.sizes().iter().find(|&&size| !(size > 0.0 && size.is_finite())) {
            Some(size) => Err(format!("a size of {size} m; it must be finite and above 0")),
            None => Ok(()),
        }
    }
}

/// Whether all principal moments of inertia are above 0.
fn is_solid(matter: &Inertial) -> bool {
    matter.inertia.symmetric_eigenvalues().min() > 0.0
}

fn plural(kind: &str) -> &'static str {
    match kind {
        "body" => "bodies",
        "joint" => "joints",
        _ => "geoms",
    }
}

fn at_least_0(what: &str, value: f64) -> Result<(), String> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(format!("{what} is {value}; it must be finite and at least 0"))
}

fn finite_pose(what: &str, pose: &Pose) -> Result<(), String> {
    let finite = pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|x| x.is_finite());
    finite.then_some(()).ok_or_else(|| format!("{what} is not finite"))
}
