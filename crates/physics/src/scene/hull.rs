//! Convex hulls of points, and their mass properties.

use std::collections::HashSet;
use std::sync::Arc;

use aforce::Vector3;
use nalgebra::Matrix3;
use rapier3d_f64::math as rapier;
use rapier3d_f64::parry::transformation::try_convex_hull;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::Inertial;

/// Thinner than this part of its length, a cloud of points is flat.
const FLAT: f64 = 1e-6;

/// The convex hull of points (m), in the frame in which they were given. A copy shares its points with the original. A
/// file holds the list of corners.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Vector3>", into = "Vec<Vector3>")]
pub struct Hull(Arc<Surface>);

#[derive(Debug, PartialEq)]
struct Surface {
    corners: Vec<Vector3>,
    triangles: Vec<[u32; 3]>,
}

/// Why points have no hull.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum HullError {
    /// Less than four different points.
    #[error("{0} different points; a body has at least 4")]
    TooFew(usize),
    /// A coordinate that is no number, or infinite.
    #[error("point {0}, counted from 0, is not finite")]
    NotFinite(usize),
    /// All points in one plane.
    #[error("its points lie in one plane, to a millionth of their extent")]
    Flat,
    /// The engine's algorithm gave up, or left out a point.
    #[error("no hull was found: some points may differ by rounding errors only")]
    Numerical,
}

impl TryFrom<Vec<Vector3>> for Hull {
    type Error = HullError;

    fn try_from(points: Vec<Vector3>) -> Result<Hull, HullError> {
        Hull::new(&points)
    }
}

impl From<Hull> for Vec<Vector3> {
    fn from(hull: Hull) -> Self {
        hull.corners().to_vec()
    }
}

impl Hull {
    /// The hull of `points` (m). Points inside it are dropped.
    ///
    /// # Errors
    /// If there are fewer than four different points, one is not finite, all lie in one plane, or rounding errors prevent a hull.
    pub fn new(points: &[Vector3]) -> Result<Hull, HullError> {
        if let Some(at) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(HullError::NotFinite(at));
        }
        let mut seen = HashSet::new();
        // Adding 0 turns -0 into 0.
        let new = |p: &&Vector3| seen.insert([p.x, p.y, p.z].map(|x| (x + 0.0).to_bits()));
        let points: Vec<Vector3> = points.iter().filter(new).copied().collect();
        if points.len() < 4 {
            return Err(HullError::TooFew(points.len()));
        }
        let (extent, thickness) = spread(&points);
        if thickness <= FLAT * extent {
            return Err(HullError::Flat);
        }
        let engine: Vec<rapier::Vector> = points.iter().map(|p| rapier::Vector::new(p.x, p.y, p.z)).collect();
        let (corners, triangles) = try_convex_hull(&engine).map_err(|_| HullError::Numerical)?;
        let corners = corners.into_iter().map(|p| Vector3::new(p.x, p.y, p.z)).collect();
        let surface = Surface { corners, triangles };
        if points.iter().any(|point| surface.distance(point) > FLAT * extent) {
            return Err(HullError::Numerical);
        }
        Ok(Hull(Arc::new(surface)))
    }

    /// The corners (m).
    pub fn corners(&self) -> &[Vector3] {
        &self.0.corners
    }

    /// The triangles of the surface: indices of three corners each, counterclockwise as seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.0.triangles
    }

    /// The hull with each coordinate multiplied by a factor: 0.001 three times for a file in millimetres.
    ///
    /// # Errors
    /// As [`Hull::new`]: a factor may be 0 or not finite.
    pub fn scaled(&self, factors: [f64; 3]) -> Result<Hull, HullError> {
        let factors = Vector3::from(factors);
        let corners: Vec<Vector3> = self.corners().iter().map(|p| p.component_mul(&factors)).collect();
        Hull::new(&corners)
    }

    /// Mass properties of the filled hull at a density (kg/m3).
    pub(super) fn inertial(&self, density: f64) -> Inertial {
        let corners = self.corners();
        // Tetrahedra from the surface to a point inside: none is much larger than the whole.
        let inside = corners.iter().sum::<Vector3>() / corners.len() as f64;
        let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for triangle in self.triangles() {
            let [a, b, c] = triangle.map(|i| corners[i as usize] - inside);
            let part = a.dot(&b.cross(&c)) / 6.0;
            let sum = a + b + c;
            volume += part;
            first += sum * (part / 4.0);
            let squares = [a, b, c, sum].iter().map(|v| v * v.transpose()).sum::<Matrix3<f64>>();
            second += squares * (part / 20.0);
        }
        let com = first / volume;
        let about_com = second - com * com.transpose() * volume;
        let inertia = (Matrix3::identity() * about_com.trace() - about_com) * density;
        Inertial { mass: volume * density, com: inside + com, inertia }
    }
}

impl Surface {
    /// How far outside a point lies (m), at least; negative inside.
    fn distance(&self, point: &Vector3) -> f64 {
        let above = self.triangles.iter().filter_map(|triangle| {
            let [a, b, c] = triangle.map(|i| self.corners[i as usize]);
            Some((b - a).cross(&(c - a)).try_normalize(0.0)?.dot(&(point - a)))
        });
        above.fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Extent and thickness of points (m): the distance of two that are far apart, and how far any is from a plane through
/// those two and the one that is farthest from the line between them.
fn spread(points: &[Vector3]) -> (f64, f64) {
    let farthest = |distance: &dyn Fn(&Vector3) -> f64| {
        points.iter().map(|p| (distance(p), *p)).max_by(|a, b| a.0.total_cmp(&b.0)).expect("four points")
    };
    let (extent, end) = farthest(&|p| (p - points[0]).norm());
    let along = (end - points[0]).normalize();
    let (_, side) = farthest(&|p| (p - points[0]).cross(&along).norm());
    let normal = along.cross(&(side - points[0]));
    let thickness = match normal.try_normalize(0.0) {
        Some(normal) => farthest(&|p| (p - points[0]).dot(&normal).abs()).0,
        None => 0.0,
    };
    (extent, thickness)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Vec<Vector3> {
        (0..8).map(|i| Vector3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))).collect()
    }

    /// Eight corners stay, the middle and a point on a face go; the triangles look outwards and enclose the volume.
    #[test]
    fn a_hull_keeps_the_corners() {
        let mut points = cube();
        points.extend([Vector3::repeat(0.5), Vector3::new(0.5, 0.25, 0.0)]);
        let hull = Hull::new(&points).unwrap();
        assert_eq!(hull.corners().len(), 8);
        assert_eq!(hull.triangles().len(), 12);
        for triangle in hull.triangles() {
            let [a, b, c] = triangle.map(|i| hull.corners()[i as usize]);
            assert!((b - a).cross(&(c - a)).dot(&(a - Vector3::repeat(0.5))) > 0.0);
        }
    }

    #[test]
    fn what_is_no_body_is_refused() {
        let answer = |points: &[Vector3]| Hull::new(points).unwrap_err();
        assert_eq!(answer(&cube()[..3]), HullError::TooFew(3));
        assert_eq!(answer(&[&cube()[..3], &cube()[..3]].concat()), HullError::TooFew(3));
        assert_eq!(answer(&cube()[..4]), HullError::Flat);
        let line: Vec<Vector3> = (0..5).map(|i| Vector3::x() * f64::from(i)).collect();
        assert_eq!(answer(&line), HullError::Flat);
        let mut points = cube();
        points[5].y = f64::NAN;
        assert_eq!(answer(&points), HullError::NotFinite(5));
        let hull = Hull::new(&cube()).unwrap();
        assert_eq!(hull.scaled([1.0, 0.0, 1.0]).unwrap_err(), HullError::Flat);
    }
}
