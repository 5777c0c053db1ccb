//! Checks a robot's numbers.

use aforce::{ConfigError, within};
use nalgebra::Matrix3;

use super::{JOINTS, Robot};
use crate::gripper::add_gripper;
use crate::scene::{Scene, inertial};
use crate::scenes::{Table, add_fixtures};

impl Robot {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is not allowed, with its field and range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        within("joints", self.joints as f64, (JOINTS - 1) as f64..=JOINTS as f64)?;
        self.arm.validate().map_err(|error| error.below("arm"))?;
        for (i, link) in self.links.iter().enumerate() {
            let field = |name: &str| format!("links[{i}].{name}");
            if i < self.joints {
                within(&field("inertial.mass"), link.inertial.mass, f64::MIN_POSITIVE..=1e4)?;
                if let Some(reason) = impossible(&link.inertial.inertia) {
                    return Err(ConfigError::Contradiction { field: field("inertial.inertia"), reason });
                }
            }
            within(&field("damping"), link.damping, 0.0..=1e4)?;
            within(&field("friction"), link.friction, 0.0..=1e4)?;
            let [low, high] = self.arm.range[i];
            within(&format!("home[{i}]"), self.home[i], low..=high)?;
            within(&format!("drives[{i}]"), self.drives[i], f64::MIN_POSITIVE..=1e6)?;
        }
        within("mount.height", self.mount.height, -10.0..=10.0)?;
        within("mount.behind_table", self.mount.behind_table, -10.0..=10.0)?;
        for geom in self.base.iter().chain(&self.mount.geoms).chain(self.links.iter().flat_map(|link| &link.geoms)) {
            for size in geom.shape.sizes() {
                within(&format!("size of the shape {:?}", geom.name), size, f64::MIN_POSITIVE..=100.0)?;
            }
        }
        // What a scene requires of every body: names, poses, friction, roles.
        let mut scene = Scene::default();
        let table = Table { size: [1.0; 3], top: [0.0; 3], friction: 1.0 };
        let base = add_fixtures(&mut scene, self, &table);
        let wrist = self.add_to(&mut scene, base);
        add_gripper(&mut scene, self, wrist);
        scene.check().map_err(|wrong| ConfigError::Contradiction { field: "bodies".into(), reason: wrong.to_string() })
    }
}

/// Why no moving link can have this inertia (kg m2); `None` if one can.
pub(super) fn impossible(inertia: &Matrix3<f64>) -> Option<String> {
    inertial::impossible(inertia).or_else(|| {
        let least = inertia.symmetric_eigenvalues().min();
        (least <= 0.0)
            .then(|| format!("principal moments of inertia of {least:.3e} kg m2 and more; each must be above 0"))
    })
}
