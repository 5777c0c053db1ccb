//! The simulated shapes as they are drawn.

use aforce::Pose;

use crate::scene::{Scene, Shape};

/// A collision shape and the body that carries it.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// Name of the geom.
    pub name: String,
    /// Index of the moving body that carries it; `None` is the world.
    pub body: Option<usize>,
    /// Pose of the shape's frame in that body's frame.
    pub pose: Pose,
    /// Shape, centred on its frame.
    pub shape: Shape,
    /// Colour.
    pub color: [u8; 3],
}

impl Scene {
    /// Every collision shape, in the order of the scene.
    pub fn solids(&self) -> Vec<Solid> {
        let of_body = |index: usize| {
            let (body, root) = self.moving_root(index);
            let geoms = self.bodies[index].geoms.iter();
            geoms.map(move |geom| Solid {
                name: geom.name.clone(),
                body,
                pose: root * geom.pose,
                shape: geom.shape.clone(),
                color: geom.color,
            })
        };
        (0..self.bodies.len()).flat_map(of_body).collect()
    }
}
