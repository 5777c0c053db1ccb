//! The limits of an axis that does not cover all values, and what is cut off there.

use super::{Panel, Reach, Series};

/// The share of the values at either end that may be cut off.
const NOT_MOST: f64 = 0.02;
/// How far the axis reaches beyond the values that are never cut off, as a share of their extent.
const ROOM: f64 = 0.5;

/// Finite, and far enough from overflow for the sums and differences of axis scaling.
pub(super) fn drawable(value: f64) -> bool {
    value.abs() < 1e100
}

/// Lowest and highest y that are drawn; `None` where all are.
pub(super) fn limits(panel: &Panel) -> Option<[f64; 2]> {
    match panel.y_reach {
        Reach::All => None,
        Reach::Between(low, high) => Some([low, high]),
        Reach::Most => {
            let mut all: Vec<f64> = panel.series.iter().flat_map(values).filter(|&y| drawable(y)).collect();
            all.sort_by(f64::total_cmp);
            let last = all.len().checked_sub(1)?;
            let skipped = (NOT_MOST * last as f64) as usize;
            let (mut low, mut high) = (all[skipped], all[last - skipped]);
            if panel.from_zero {
                (low, high) = (low.min(0.0), high.max(0.0));
            }
            let room = ROOM * (high - low);
            Some([low - room, high + room])
        }
    }
}

/// Where a series lies outside the limits: x and the limit, once each.
pub(super) fn beyond(series: &Series, [low, high]: [f64; 2]) -> Vec<(f64, f64)> {
    let points = series.points.iter().chain(&series.dots).map(|&(x, y)| (x, y, y));
    let mut places = vec![];
    for (x, lowest, highest) in points.chain(series.band.iter().copied()) {
        for (edge, out) in [(low, lowest < low), (high, highest > high)] {
            if out && !places.contains(&(x, edge)) {
                places.push((x, edge));
            }
        }
    }
    places
}

fn values(series: &Series) -> Vec<f64> {
    let points = series.points.iter().chain(&series.dots).map(|point| point.1);
    points.chain(series.band.iter().flat_map(|&(_, low, high)| [low, high])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outlier_is_cut_off_and_its_place_is_known() {
        let curve: Vec<_> = (0..100).map(|k| (f64::from(k), if k == 70 { -1250.0 } else { f64::from(k) })).collect();
        let series = Series { band: vec![(70.0, -1300.0, 50.0)], ..Series::new("aforce", curve) };
        let panel = Panel { series: vec![series], y_reach: Reach::Most, from_zero: true, ..Panel::default() };
        let [low, high] = limits(&panel).unwrap();
        assert!((-60.0..0.0).contains(&low) && (99.0..150.0).contains(&high), "{low} to {high}");
        assert_eq!(beyond(&panel.series[0], [low, high]), [(70.0, low)]);
        let calm = Panel { series: vec![Series::new("osc", vec![(0.0, 0.0), (1.0, 1.0), (2.0, 3.0)])], ..panel };
        assert!(limits(&calm).is_some_and(|[low, high]| low < 0.0 && high > 3.0), "nothing is cut off");
        assert_eq!(limits(&Panel { y_reach: Reach::All, ..calm }), None);
    }
}
