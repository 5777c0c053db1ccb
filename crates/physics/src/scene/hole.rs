//! A round hole that the engine collides with exactly: a ring of convex wedges.

use std::f64::consts::TAU;

use aforce::Vector3;
use thiserror::Error;

use super::{Hull, HullError};

/// A round hole along z in a round block, open at z = 0 and above, through to z = -`depth` (m).
///
/// Each sector is one wedge that includes its part of the chamfer: a chamfer of separate bodies would have seams, at which the
/// edge of a peg catches. The wall is flat in each sector and touches the circle of the radius from outside, so a round peg
/// fits if and only if it is thinner than the hole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hole {
    /// Radius of the hole (m).
    pub radius: f64,
    /// Radius of the block (m).
    pub outer: f64,
    /// Length of the hole (m).
    pub depth: f64,
    /// Width and depth of the chamfer, at 45 degrees (m); 0: none.
    pub chamfer: f64,
    /// Number of wedges; 24 is enough for a clearance of 0.1 mm.
    pub sectors: usize,
}

/// Sizes that make no hole.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum HoleError {
    /// Sizes that contradict each other.
    #[error(
        "a hole needs a radius above 0, a chamfer of at least 0 that is less than its depth, an outer radius beyond both, and 3 to 200 sectors; this one is {0:?}"
    )]
    Sizes(Hole),
    /// Sizes that differ by rounding errors only.
    #[error("{0}")]
    Hull(#[from] HullError),
}

impl Hole {
    /// The wedges, the first of which begins at the x axis. All lie in the frame of the hole: its axis is z, its rim at z = 0.
    ///
    /// # Errors
    /// If the sizes contradict each other.
    pub fn wedges(&self) -> Result<Vec<Hull>, HoleError> {
        let Hole { radius, outer, depth, chamfer, sectors } = *self;
        let finite = [radius, outer, depth, chamfer].iter().all(|size| size.is_finite());
        let allowed = finite && radius > 0.0 && chamfer >= 0.0 && chamfer < depth && radius + chamfer < outer;
        if !allowed || !(3..=200).contains(&sectors) {
            return Err(HoleError::Sizes(*self));
        }
        let angle = TAU / sectors as f64;
        // The ends of a flat wall are this many times as far from the axis as its middle.
        let stretch = 1.0 / libm::cos(angle / 2.0);
        let profile = [(radius, -depth), (radius, -chamfer), (radius + chamfer, 0.0), (outer, 0.0), (outer, -depth)];
        let wedge = |sector: usize| {
            let ends = [sector, sector + 1].map(|at| libm::sincos(angle * at as f64));
            let at =
                |(sin, cos): (f64, f64)| profile.map(|(r, z)| Vector3::new(stretch * r * cos, stretch * r * sin, z));
            Hull::new(ends.map(at).as_flattened())
        };
        (0..sectors).map(|sector| wedge(sector).map_err(HoleError::from)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Inertial, Shape};

    /// The wedges together are a regular prism with a hole: their volumes add up, chamfer included.
    #[test]
    fn wedges_fill_the_ring() {
        let mut hole = Hole { radius: 0.005, outer: 0.02, depth: 0.025, chamfer: 0.0, sectors: 24 };
        let volume = |hole: &Hole| {
            let wedges = hole.wedges().unwrap();
            assert_eq!(wedges.len(), 24);
            wedges.into_iter().map(|wedge| Inertial::solid(&Shape::Convex(wedge), 1.0).mass).sum::<f64>()
        };
        let area = |r: f64| 24.0 * r * r * libm::tan(TAU / 48.0);
        let ring = 0.025 * (area(0.02) - area(0.005));
        assert!((volume(&hole) / ring - 1.0).abs() < 1e-12);
        hole.chamfer = 0.001;
        // A frustum less the prism in it.
        let cut = 0.001 * ((area(0.005) + area(0.006) + (area(0.005) * area(0.006)).sqrt()) / 3.0 - area(0.005));
        assert!((volume(&hole) / (ring - cut) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn sizes_that_contradict_are_refused() {
        let hole = Hole { radius: 0.005, outer: 0.02, depth: 0.025, chamfer: 0.001, sectors: 24 };
        for wrong in [
            Hole { radius: 0.0, ..hole },
            Hole { outer: 0.006, ..hole },
            Hole { chamfer: 0.03, ..hole },
            Hole { chamfer: -0.001, ..hole },
            Hole { sectors: 2, ..hole },
            Hole { depth: f64::NAN, ..hole },
        ] {
            assert!(matches!(wrong.wedges(), Err(HoleError::Sizes(_))), "{wrong:?}");
        }
    }
}
