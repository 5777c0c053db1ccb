//! Shape, place and mass of a geom.

use aforce::{Pose, Vector3};

use super::element::Element;
use crate::objects::defaults::OF_GEOM;
use crate::objects::{ReadError, nameless};
use crate::scene::{Geom, Inertial, Role, Shape, between};

/// MuJoCo's density of a geom without mass (kg/m3), its sliding friction and its colour.
const DENSITY: f64 = 1000.0;
const FRICTION: f64 = 1.0;
const GREY: [u8; 3] = [128; 3];

/// Attributes of a geom that are not read from a class.
const ATTRIBUTES: [&str; 9] = ["name", "class", "fromto", "mesh", "pos", "quat", "euler", "axisangle", "mass"];

impl Element<'_> {
    /// A geom in its body's frame as it is in the file, and its mass in the geom's frame. `others` are the geoms before it in its body.
    pub fn geom(self, body: &str, others: &[Geom]) -> Result<(Geom, Inertial), ReadError> {
        self.allow(&[&ATTRIBUTES[..], &OF_GEOM].concat())?;
        let pose = self.file.pose(self.node)?;
        let kind = self.value("type")?.unwrap_or("sphere");
        let ends = self.ends(kind)?;
        let shape = self.shape(kind, ends.map(|(_, half_length)| half_length))?;
        if kind != "mesh" && self.node.has_attribute("mesh") {
            return Err(self.wrong(format!("a {kind} that is fitted to a mesh is not read")));
        }
        let friction = self.friction()?;
        let inertial = self.mass(&shape)?;
        let color = self.value("rgba")?.map_or(Ok(GREY), |text| self.file.source.color(self.node, "rgba", text))?;
        let name = self.node.attribute("name").map_or_else(|| nameless(body, others), String::from);
        let pose = ends.map_or(pose, |(pose, _)| pose);
        Ok((Geom { name, shape, pose, friction, role: Role::Object, color }, inertial))
    }

    /// Pose and half length of a geom that says where its ends are.
    fn ends(self, kind: &str) -> Result<Option<(Pose, f64)>, ReadError> {
        let Some(text) = self.node.attribute("fromto") else { return Ok(None) };
        let [a, b, c, d, e, f] = self.file.source.array(self.node, "fromto", text)?;
        if !["capsule", "cylinder"].contains(&kind) {
            return Err(self.wrong("fromto is read for capsules and cylinders"));
        }
        if ["pos", "quat", "euler", "axisangle"].iter().any(|name| self.node.has_attribute(*name)) {
            return Err(self.wrong("fromto says position and direction; others beside it contradict it"));
        }
        Ok(Some(between([a, b, c], [d, e, f])))
    }

    /// The geom's shape; `half_length` is that of a `fromto`.
    fn shape(self, kind: &str, half_length: Option<f64>) -> Result<Shape, ReadError> {
        let too_few = |wanted: &str| self.wrong(format!("the size of a {kind} is {wanted}"));
        match kind {
            "box" => {
                let [x, y, z] = self.sizes()?[..] else { return Err(too_few("three half lengths")) };
                Ok(Shape::Box(Vector3::new(x, y, z)))
            }
            "sphere" => {
                let [radius] = self.sizes()?[..] else { return Err(too_few("a radius")) };
                Ok(Shape::Sphere { radius })
            }
            "capsule" | "cylinder" => {
                let (radius, half_length) = match (&self.sizes()?[..], half_length) {
                    (&[radius], Some(half_length)) | (&[radius, half_length], None) => (radius, half_length),
                    _ => return Err(too_few("a radius and a half length, or with fromto a radius")),
                };
                Ok(match kind {
                    "capsule" => Shape::Capsule { half_length, radius },
                    _ => Shape::Cylinder { half_length, radius },
                })
            }
            "mesh" => {
                let name = self.file.source.required(self.node, "mesh")?;
                let hull = self.file.meshes.get(name).cloned();
                hull.map(Shape::Convex).ok_or_else(|| self.wrong(format!("there is no mesh {name:?}")))
            }
            other => Err(self.wrong(format!("type={other:?}; read are box, sphere, capsule, cylinder and mesh"))),
        }
    }

    fn sizes(self) -> Result<Vec<f64>, ReadError> {
        match self.value("size")? {
            Some(text) => self.file.source.numbers(self.node, "size", text),
            None => Err(self.wrong("the attribute \"size\" is missing")),
        }
    }

    /// Coefficient of sliding friction. Torsional and rolling friction act only where `condim` is above 3.
    fn friction(self) -> Result<f64, ReadError> {
        if self.value("condim")?.is_some_and(|condim| condim != "3") {
            return Err(self.wrong("condim is read where it is 3"));
        }
        match self.value("friction")? {
            Some(text) => Ok(self.file.source.numbers(self.node, "friction", text)?[0]),
            None => Ok(FRICTION),
        }
    }

    /// Mass properties from the attribute `mass`, or else from the density.
    fn mass(self, shape: &Shape) -> Result<Inertial, ReadError> {
        let size = |name, text| self.file.source.size(self.node, name, text);
        Ok(match (self.node.attribute("mass"), self.value("density")?) {
            (Some(text), _) => Inertial::of_mass(shape, size("mass", text)?),
            (None, Some(text)) => Inertial::solid(shape, size("density", text)?),
            (None, None) => Inertial::solid(shape, DENSITY),
        })
    }
}
