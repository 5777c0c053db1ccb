//! The dirt to be wiped: markers along a random walk over the table (robosuite 1.4), or all over a round spot.

use aforce::{Pose, Vector3};
use nalgebra::{Point3, Vector2};
use physics::scenes::wipe::{TABLE_CENTRE, TABLE_SIZE};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::normal::standard_normal;
use crate::normalisation::MARKERS;

/// Radius of a marker (m).
pub const RADIUS: f64 = 0.02;
/// Share of the table on which markers may lie.
const COVERAGE: f64 = 0.6;
/// Distance from one marker to the next (m): a path of half a metre.
const SPACING: f64 = 0.5 / MARKERS as f64;
/// Probability that the walk changes its heading at a marker, and the deviation of the
/// change (rad).
const TURN: (f64, f64) = (0.3, 0.5);
/// Half length along x and half width along y of the face that wipes, in the tool frame (m).
const FACE: [f64; 2] = [0.06, 0.025];
/// A marker is wiped from 2 mm in front of the plane of the face to 2 cm behind it (m; the
/// tool's z points at the table).
const REACH: [f64; 2] = [-0.02, 0.002];

/// Markers on the table top, each wiped or not.
#[derive(Debug, Clone)]
pub struct Markers {
    /// Middle of each marker (m, world).
    positions: Vec<Vector3>,
    wiped: Vec<bool>,
}

impl Markers {
    /// A random walk from a random place, on a table top of the given height (m).
    pub fn random(height: f64, rng: &mut ChaCha8Rng) -> Self {
        let limit = Vector2::from(TABLE_SIZE) * (0.5 * COVERAGE) - Vector2::repeat(RADIUS);
        let mut at = limit.map(|l| rng.random_range(-l..l));
        let mut heading = rng.random_range(-std::f64::consts::PI..std::f64::consts::PI);
        let mut positions = Vec::with_capacity(MARKERS);
        loop {
            positions.push(Vector3::new(TABLE_CENTRE[0] + at.x, TABLE_CENTRE[1] + at.y, height));
            if positions.len() == MARKERS {
                return Markers { wiped: vec![false; MARKERS], positions };
            }
            if rng.random_bool(TURN.0) {
                heading += TURN.1 * standard_normal(rng);
            }
            let next = |heading: f64| at + Vector2::new(libm::sin(heading), libm::cos(heading)) * SPACING;
            while (next(heading).abs() - limit).max() >= 0.0 {
                heading += TURN.1 * standard_normal(rng);
            }
            at = next(heading);
        }
    }

    /// A round spot, evenly covered, around a point on a table top (m, world).
    pub fn spot(centre: Vector3, radius: f64) -> Self {
        // Vogel's spiral: every marker has an equal share of the area, and none of them form rows.
        let golden_angle = std::f64::consts::PI * (3.0 - 5f64.sqrt());
        let marker = |i: usize| {
            let (sin, cos) = libm::sincos(golden_angle * i as f64);
            centre + Vector3::new(cos, sin, 0.0) * radius * ((i as f64 + 0.5) / MARKERS as f64).sqrt()
        };
        Markers { positions: (0..MARKERS).map(marker).collect(), wiped: vec![false; MARKERS] }
    }

    /// Wipes the markers under the face of a tool at `pose`; returns how many are new.
    pub fn wipe(&mut self, pose: &Pose) -> usize {
        let before = self.wiped_count();
        for (position, wiped) in self.positions.iter().zip(&mut self.wiped) {
            let local = pose.inverse_transform_point(&Point3::from(*position));
            *wiped |= local.x.abs() < FACE[0] && local.y.abs() < FACE[1] && (REACH[0]..REACH[1]).contains(&local.z);
        }
        self.wiped_count() - before
    }

    /// Number of wiped markers.
    pub fn wiped_count(&self) -> usize {
        self.wiped.iter().filter(|&&wiped| wiped).count()
    }

    /// Every marker (m, world) and whether it is wiped.
    pub fn iter(&self) -> impl Iterator<Item = (Vector3, bool)> {
        self.positions.iter().copied().zip(self.wiped.iter().copied())
    }

    /// Share of the markers that are wiped.
    pub fn wiped_share(&self) -> f64 {
        self.wiped_count() as f64 / self.positions.len() as f64
    }

    /// The markers that are not wiped yet (m, world).
    pub fn remaining(&self) -> impl Iterator<Item = Vector3> {
        self.iter().filter(|(_, wiped)| !wiped).map(|(position, _)| position)
    }

    /// Middle of the remaining markers (m, world), and the largest distance of one from it;
    /// `None` when all are wiped.
    pub fn centroid_and_radius(&self) -> Option<(Vector3, f64)> {
        let count = MARKERS - self.wiped_count();
        let centroid = self.remaining().sum::<Vector3>() / count as f64;
        let radius = self.remaining().map(|marker| (marker - centroid).norm()).fold(0.0, f64::max);
        (count > 0).then_some((centroid, radius))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use rand::SeedableRng;

    /// Markers on a table top at height 0.
    fn at(positions: &[[f64; 2]]) -> Markers {
        let positions: Vec<_> = positions.iter().map(|p| Vector3::new(p[0], p[1], 0.0)).collect();
        Markers { wiped: vec![false; positions.len()], positions }
    }

    /// A tool that looks down from `height`, its x axis along the world's x axis, tilted
    /// about that axis.
    fn tool(height: f64, tilt: f64) -> Pose {
        Pose::new(Vector3::new(0.0, 0.0, height), Vector3::x() * (std::f64::consts::PI + tilt))
    }

    /// In 60 resets of robosuite the mean radius was 0.145 m, the mean extents along x and y were 0.16 and 0.21 m.
    #[test]
    fn layouts_look_like_robosuites() {
        const LAYOUTS: u64 = 200;
        let (mut radius, mut extent) = (0.0, [0.0; 2]);
        for seed in 0..LAYOUTS {
            let markers = Markers::random(0.9, &mut ChaCha8Rng::seed_from_u64(seed));
            radius += markers.centroid_and_radius().unwrap().1 / LAYOUTS as f64;
            for (axis, extent) in extent.iter_mut().enumerate() {
                let middle = TABLE_CENTRE[axis];
                let along = || markers.remaining().map(|m| m[axis] - middle);
                let (low, high) = (along().fold(f64::MAX, f64::min), along().fold(f64::MIN, f64::max));
                assert!(low > -[0.13, 0.22][axis] && high < [0.13, 0.22][axis]);
                *extent += (high - low) / LAYOUTS as f64;
            }
            let step = (markers.positions[57] - markers.positions[56]).norm();
            assert!((step - SPACING).abs() < 1e-12 && markers.positions.len() == MARKERS);
        }
        println!("radius {radius:.3} m, extents {extent:.3?} m");
        assert!((radius - 0.145).abs() < 0.01, "{radius}");
        assert!((extent[0] - 0.16).abs() < 0.015 && (extent[1] - 0.21).abs() < 0.02, "{extent:?}");
    }

    #[test]
    fn a_spot_is_round_and_even() {
        let centre = Vector3::new(0.1, -0.2, 0.9);
        let mut spot = Markers::spot(centre, 0.07);
        let (middle, radius) = spot.centroid_and_radius().unwrap();
        assert!((middle - centre).norm() < 0.002 && (0.065..0.072).contains(&radius), "{middle} {radius}");
        let inner = spot.remaining().filter(|m| (m - centre).norm() < 0.035).count();
        assert_eq!(inner, MARKERS / 4, "a quarter of the area");
        assert_eq!(spot.wiped_share(), 0.0);
        spot.wipe(&Pose::new(centre, Vector3::x() * std::f64::consts::PI));
        // The face covers 0.12 x 0.05 m of a disc of 0.0154 m2.
        assert!((spot.wiped_share() - 0.39).abs() < 0.03, "{}", spot.wiped_share());
    }

    #[test]
    fn the_face_is_long_along_its_x_axis() {
        let mut markers = at(&[[0.0, 0.0], [0.059, 0.024], [0.061, 0.0], [0.0, -0.026], [-0.059, -0.024]]);
        assert_eq!(markers.wipe(&tool(-0.0005, 0.0)), 3);
        let wiped: Vec<bool> = markers.iter().map(|(_, wiped)| wiped).collect();
        assert_eq!(wiped, [true, true, false, false, true]);
        assert_eq!(markers.wipe(&tool(-0.0005, 0.0)), 0, "each counts once");
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
        assert_eq!(markers.wipe(&(turned * tool(-0.0005, 0.0))), 1, "the other way round");
    }

    #[test]
    fn a_face_in_the_air_or_on_edge_wipes_only_what_it_is_near() {
        assert_eq!(at(&[[0.0, 0.0]]).wipe(&tool(0.003, 0.0)), 0);
        // 0.1 rad: the plane rises by 1 mm over 1 cm.
        let mut markers = at(&[[0.0, -0.02], [0.0, 0.0], [0.0, 0.015], [0.0, 0.02], [0.0, -0.015]]);
        assert_eq!(markers.wipe(&tool(0.0012, 0.1)), 3);
        // A tool tilted by 0.9 rad has a marker 3 cm below it 19 mm in front of its face: too far to wipe it.
        assert_eq!(at(&[[0.0, 0.0]]).wipe(&tool(0.03, 0.9)), 0);
    }
}
