//! How a policy sees Wipe's markers.

use aforce::Vector3;
use physics::scenes::wipe::{TABLE_CENTRE, TABLE_HEIGHT};

use super::markers::Markers;
use crate::observation_options::MarkerView;
use crate::observer::Observer;

/// A place in the middle of the table top (m, world).
const MIDDLE: [f64; 3] = [TABLE_CENTRE[0], TABLE_CENTRE[1], TABLE_HEIGHT];

impl MarkerView {
    /// Puts the markers as seen from a tool at `tool` (m, world): 8, 14 or 700 numbers. The markers are believed to lie `raised`
    /// (m) lower than they do. When all are wiped, radius, centroid and ends are zero, the first two as in robosuite.
    pub(crate) fn observe(self, markers: &Markers, raised: f64, tool: &Vector3, out: &mut Observer) {
        let believed = |marker: Vector3| marker - raised * Vector3::z();
        if self == MarkerView::All {
            for (i, (marker, wiped)) in markers.iter().enumerate() {
                let marker = believed(marker);
                out.position(format_args!("marker{i}_pos"), marker, MIDDLE, 5.0);
                out.put(format_args!("marker{i}_wiped"), f64::from(wiped), "0 or 1", 0.0, 1.0);
                out.position(format_args!("gripper_to_marker{i}"), marker - tool, [0.0; 3], 5.0);
            }
            return;
        }
        let (centroid, radius) =
            markers.centroid_and_radius().map_or((Vector3::zeros(), 0.0), |(c, radius)| (believed(c), radius));
        out.put("proportion_wiped", markers.wiped_share(), "1", 0.5, 2.0);
        out.put("wipe_radius", radius, "m", 0.1, 10.0);
        out.position("wipe_centroid", centroid, MIDDLE, 5.0);
        out.position("gripper_to_wipe_centroid", centroid - tool, [0.0; 3], 5.0);
        if self == MarkerView::Ends {
            let seen = || markers.remaining().map(|marker| believed(marker) - tool);
            let nearer = |a: &Vector3, b: &Vector3| a.norm().total_cmp(&b.norm());
            let (nearest, farthest) = (seen().min_by(nearer), seen().max_by(nearer));
            out.position("gripper_to_nearest_marker", nearest.unwrap_or_default(), [0.0; 3], 5.0);
            out.position("gripper_to_farthest_marker", farthest.unwrap_or_default(), [0.0; 3], 5.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Translation3;
    use physics::wiping_tool::facing_down;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    const ALL: [MarkerView; 3] = [MarkerView::Condensed, MarkerView::Ends, MarkerView::All];

    fn seen(view: MarkerView, markers: &Markers, raised: f64, tool: &Vector3) -> Vec<f32> {
        let mut out = Observer::default();
        view.observe(markers, raised, tool, &mut out);
        out.values().to_vec()
    }

    #[test]
    fn nearest_and_farthest_are_of_those_that_remain() {
        let mut markers = Markers::random(0.9, &mut ChaCha8Rng::seed_from_u64(1));
        let first = markers.remaining().next().unwrap();
        let tool = first + Vector3::new(0.0, 0.0, 0.001);
        let near = seen(MarkerView::Ends, &markers, 0.0, &tool);
        assert!((near[8..11].iter().map(|v| v * v).sum::<f32>().sqrt() - 0.001).abs() < 1e-6);
        markers.wipe(&aforce::Pose::from_parts(Translation3::from(first), facing_down()));
        let later = seen(MarkerView::Ends, &markers, 0.0, &tool);
        let norm = |v: &[f32]| v.iter().map(|v| v * v).sum::<f32>().sqrt();
        assert!(norm(&later[8..11]) > 0.01 && norm(&later[11..14]) >= norm(&later[8..11]));
        let all = seen(MarkerView::All, &markers, 0.0, &tool);
        assert_eq!(all.chunks(7).filter(|marker| marker[3] == 1.0).count(), markers.wiped_count());
        assert!(all.chunks(7).all(|m| (0..3).all(|i| (m[4 + i] - (m[i] - tool[i] as f32)).abs() < 1e-6)));
    }

    /// A raised table gives the same numbers as one at the believed height.
    #[test]
    fn how_high_the_table_stands_is_not_seen() {
        let markers = |height| Markers::random(height, &mut ChaCha8Rng::seed_from_u64(1));
        let tool = Vector3::new(0.1, 0.0, 0.95);
        for view in ALL {
            let (there, raised) = (seen(view, &markers(0.9), 0.0, &tool), seen(view, &markers(0.92), 0.02, &tool));
            assert!(there.iter().zip(&raised).all(|(a, b)| (a - b).abs() < 1e-6), "{view:?}");
        }
    }

    #[test]
    fn nothing_is_seen_when_all_is_wiped() {
        let mut markers = Markers::random(0.9, &mut ChaCha8Rng::seed_from_u64(1));
        for marker in markers.remaining().collect::<Vec<_>>() {
            markers.wipe(&aforce::Pose::from_parts(Translation3::from(marker), facing_down()));
        }
        let tool = Vector3::new(0.1, 0.0, 0.95);
        let ends = seen(MarkerView::Ends, &markers, 0.0, &tool);
        assert_eq!(ends[1..5], [0.0; 4]);
        assert_eq!(ends[8..14], [0.0; 6]);
    }
}
