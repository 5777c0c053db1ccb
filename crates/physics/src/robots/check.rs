//! Whether a robot's numbers are those of an arm.

use aforce::{ConfigError, within};
use nalgebra::Matrix3;

use super::{JOINTS, Robot};
use crate::gripper::add_gripper;
use crate::scene::Scene;
use crate::scenes::{Table, add_fixtures};

/// What rounding in published tables may take off the triangle inequality, as a share of the largest moment.
const ROUNDED: f64 = 1e-3;

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
        // What a scene asks of every body: names, poses, friction, roles.
        let mut scene = Scene::default();
        let table = Table { size: [1.0; 3], top: [0.0; 3], friction: 1.0 };
        let base = add_fixtures(&mut scene, self, &table);
        let wrist = self.add_to(&mut scene, base);
        add_gripper(&mut scene, self, wrist);
        scene.check().map_err(|wrong| ConfigError::Contradiction { field: "bodies".into(), reason: wrong.to_string() })
    }
}

/// Why no body has this inertia, if none has.
pub(super) fn impossible(inertia: &Matrix3<f64>) -> Option<String> {
    if inertia.iter().any(|part| !part.is_finite()) {
        return Some("the inertia is not finite".into());
    }
    let mut moments: Vec<f64> = inertia.symmetric_eigenvalues().iter().copied().collect();
    moments.sort_by(f64::total_cmp);
    let [a, b, c] = moments[..] else { return None };
    let told = format!("principal moments of inertia of {a:.3e}, {b:.3e} and {c:.3e} kg m2");
    if a <= 0.0 {
        return Some(format!("{told}; each must be above 0"));
    }
    (a + b < c * (1.0 - ROUNDED))
        .then(|| format!("{told}; no body has them, as the largest exceeds the sum of the others"))
}
