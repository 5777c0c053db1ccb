//! Statistics over seeds, the unit of replication. Seeds are few, so intervals of statistics other than a mean come
//! from resampling (Agarwal et al. 2021, "Deep reinforcement learning at the edge of the statistical precipice").

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Resamples behind an interval of at most [`FEW`] values, and the least number for any number of values. In between, more
/// values have fewer resamples, so that an interval takes the same time.
const RESAMPLES: usize = 10_000;
const FEWEST_RESAMPLES: usize = 1000;
/// Largest number of values with [`RESAMPLES`] resamples.
const FEW: usize = 100;
/// Share of resamples inside an interval.
const CONFIDENCE: f64 = 0.95;

/// With fewer runs a bootstrap interval is the range from the lowest value to the highest, or nearly, as too many resamples draw nothing but the
/// lowest. Such a range must not be called a 95 % interval: that of three runs holds the true median in 75 % of the cases.
pub const FEWEST_FOR_INTERVAL: usize = 5;

/// Arithmetic mean; NaN without values.
pub fn mean(values: &[f64]) -> f64 {
    mean_of(values, |&value| value)
}

/// Arithmetic mean of a number of every item; NaN without items.
pub fn mean_of<T>(items: &[T], number: impl Fn(&T) -> f64) -> f64 {
    items.iter().map(number).sum::<f64>() / items.len() as f64
}

/// Standard deviation of the population that `values` are a sample of (n - 1); NaN for fewer than two values.
pub fn deviation(values: &[f64]) -> f64 {
    if values.len() < 2 {
        return f64::NAN;
    }
    let centre = mean(values);
    (values.iter().map(|v| (v - centre).powi(2)).sum::<f64>() / (values.len() as f64 - 1.0)).sqrt()
}

/// The middle value, or the mean of the middle two; NaN without values.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// The `share` quantile of `values`, interpolated between the two nearest (as NumPy does); NaN without values.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    percentile(&sorted(values), share)
}

/// Interquartile mean: the mean without the lowest and the highest quarter (rounded down).
pub fn iqm(values: &[f64]) -> f64 {
    middle_mean(&sorted(values))
}

/// The interval of [`iqm`], by [`interval`]'s resamples.
pub fn iqm_interval(values: &[f64]) -> [f64; 2] {
    stratified_iqm_interval(&[values])
}

/// The interval of the interquartile mean of the values of all `groups`, where each group is redrawn by itself. For runs of several tasks it
/// is that of the aggregate of Agarwal et al. 2021.
pub fn stratified_iqm_interval(groups: &[&[f64]]) -> [f64; 2] {
    // Counting how often each of the sorted values is drawn gives a sorted sample.
    let all: Vec<f64> = groups.concat();
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|&i, &j| all[i].total_cmp(&all[j]));
    let mut drawn = vec![0; all.len()];
    let mut sample = Vec::with_capacity(all.len());
    bootstrap(all.len(), |rng| {
        drawn.fill(0);
        let mut first = 0;
        for group in groups {
            for _ in 0..group.len() {
                drawn[first + rng.random_range(0..group.len())] += 1;
            }
            first += group.len();
        }
        sample.clear();
        order.iter().for_each(|&at| sample.extend(std::iter::repeat_n(all[at], drawn[at])));
        middle_mean(&sample)
    })
}

/// Mean of sorted values without the lowest and the highest quarter (rounded down).
fn middle_mean(sorted: &[f64]) -> f64 {
    let cut = sorted.len() / 4;
    mean(&sorted[cut..sorted.len() - cut])
}

/// Probability that a run drawn from `a` exceeds one drawn from `b`; a tie counts half.
pub fn probability_of_improvement(a: &[f64], b: &[f64]) -> f64 {
    let mut b_sorted = sorted(b);
    b_sorted.retain(|y| !y.is_nan());
    let below = |x: &f64| b_sorted.partition_point(|y| y < x);
    let not_above = |x: &f64| b_sorted.partition_point(|y| y <= x);
    let doubled_wins: usize = a.iter().map(|x| below(x) + not_above(x)).sum();
    0.5 * doubled_wins as f64 / (a.len() * b.len()) as f64
}

/// Lowest and highest value; infinity and minus infinity without values.
pub fn range(values: &[f64]) -> [f64; 2] {
    [values.iter().copied().fold(f64::INFINITY, f64::min), values.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
}

/// The interval, or `None` if its ends are equal. Values that are all equal give equal ends, which do not tell how certain the mean is.
pub fn with_width(interval: [f64; 2]) -> Option<[f64; 2]> {
    (interval[0] < interval[1]).then_some(interval)
}

/// Percentile bootstrap: the interval that holds 95 % of `statistic` over samples redrawn, with
/// replacement, within each of `groups`. The same groups give the same interval.
pub fn interval(groups: &[&[f64]], statistic: impl Fn(&[Vec<f64>]) -> f64) -> [f64; 2] {
    let mut redrawn: Vec<Vec<f64>> = groups.iter().map(|group| group.to_vec()).collect();
    bootstrap(groups.iter().map(|group| group.len()).sum(), |rng| {
        for (sample, group) in redrawn.iter_mut().zip(groups) {
            sample.fill_with(|| group[rng.random_range(0..group.len())]);
        }
        statistic(&redrawn)
    })
}

/// The interval that holds 95 % of the results of `outcome`, which draws one resample at each call; `values` is the size of a resample.
fn bootstrap(values: usize, mut outcome: impl FnMut(&mut ChaCha8Rng) -> f64) -> [f64; 2] {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let resamples = (RESAMPLES * FEW / values.max(FEW)).max(FEWEST_RESAMPLES);
    let outcomes = sorted(&(0..resamples).map(|_| outcome(&mut rng)).collect::<Vec<_>>());
    [(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0].map(|share| percentile(&outcomes, share))
}

/// Welch's 95 % interval of the mean of `a` less that of `b`, for normal samples, each with its own standard deviation. For few values
/// it is wider than the bootstrap's interval, which holds the true value in less than 95 % of the cases. `None` if a sample has fewer
/// than two values, one that is not finite, or values too far apart to be squared.
pub fn welch_interval(a: &[f64], b: &[f64]) -> Option<[f64; 2]> {
    // Square of the mean's standard error, and what it adds to the degrees of freedom.
    let [(a_error, a_part), (b_error, b_part)] = [a, b].map(|sample| {
        let error = deviation(sample).powi(2) / sample.len() as f64;
        (error, error.powi(2) / (sample.len() as f64 - 1.0))
    });
    let (difference, error) = (mean(a) - mean(b), a_error + b_error);
    if !(difference + error).is_finite() {
        return None;
    }
    if error == 0.0 {
        return Some([difference; 2]);
    }
    // The degrees of freedom are no number where the square of an error is too large for one.
    let t = StudentsT::new(0.0, 1.0, error.powi(2) / (a_part + b_part)).ok()?;
    // Rounded: mathematical functions differ in their last bits from one platform to the next.
    let half = (t.inverse_cdf((1.0 + CONFIDENCE) / 2.0) * 1e6).round() / 1e6 * error.sqrt();
    Some([difference - half, difference + half])
}

/// Student's 95 % interval of the mean of a normal sample; `None` as in [`welch_interval`], which is Student's against a constant.
pub fn student_interval(sample: &[f64]) -> Option<[f64; 2]> {
    welch_interval(sample, &[0.0; 2])
}

/// The 95 % interval of the mean of `a` divided by the mean of `b`. It is Welch's interval of the ratio's logarithm,
/// for which each sample's standard error counts as a share of its mean. `None` as in [`welch_interval`], or if a mean is
/// not above zero.
pub fn ratio_interval(a: &[f64], b: &[f64]) -> Option<[f64; 2]> {
    let shares = |sample: &[f64]| sample.iter().map(|value| value / mean(sample)).collect::<Vec<_>>();
    let ratio = mean(a) / mean(b);
    let above_zero = mean(a) > 0.0 && mean(b) > 0.0;
    let logarithm = welch_interval(&shares(a), &shares(b)).filter(|_| above_zero)?;
    Some(logarithm.map(|end| ratio * end.exp()))
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values
}

/// The `share` quantile of sorted values, interpolated linearly; NaN without values.
fn percentile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = share * last as f64;
    let (below, above) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    // The difference of two infinite values is NaN.
    if below == above && below.is_infinite() { below } else { below + (above - below) * at.fract() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(text: &str) -> Vec<f64> {
        text.split_whitespace().map(|cell| cell.parse().unwrap()).collect()
    }

    /// `scripts/statistics_reference.py` asks NumPy, SciPy and rliable.
    #[test]
    fn agrees_with_scipy_and_rliable() {
        let mut reader = csv::Reader::from_reader(&include_bytes!("../reference/statistics.csv")[..]);
        let mut rows = 0;
        for record in reader.records() {
            let record = record.unwrap();
            let (a, b) = (numbers(&record[0]), numbers(&record[1]));
            let expected: Vec<f64> = record.iter().skip(2).map(|cell| cell.parse().unwrap()).collect();
            let exact = [mean(&a), deviation(&a), median(&a), iqm(&a), probability_of_improvement(&a, &b)];
            for (found, expected) in exact.iter().zip(&expected) {
                assert!((found - expected).abs() < 1e-9 * expected.abs().max(1.0), "{record:?}: {found}");
            }
            let intervals =
                [interval(&[&a], |s| iqm(&s[0])), interval(&[&a, &b], |s| probability_of_improvement(&s[0], &s[1]))];
            // Both sides resample at random, and a probability moves in steps of one pair.
            let [low, high] = range(&a);
            let spread = [0.03 * (high - low), 2.0 / (a.len() * b.len()) as f64];
            for (k, (found, spread)) in intervals.iter().zip(spread).enumerate() {
                for (found, expected) in found.iter().zip(&expected[5 + 2 * k..]) {
                    assert!((found - expected).abs() <= spread, "{record:?}: {found} for {expected}");
                }
            }
            let closed = [welch_interval(&a, &b), student_interval(&a)].map(Option::unwrap).concat();
            for (found, expected) in closed.iter().zip(&expected[9..13]) {
                assert!((found - expected).abs() < 1e-4, "{record:?}: {closed:?}");
            }
            rows += 1;
        }
        assert!(rows >= 5);
    }

    /// To the last bit, and in time that grows with the number of values.
    #[test]
    fn an_interval_of_the_interquartile_mean_is_that_of_sorted_resamples() {
        let values = |n: usize| (0..n).map(|k| ((k * k) % 17) as f64 + 0.1 * k as f64).collect::<Vec<_>>();
        let (few, many) = (values(9), values(7));
        assert_eq!(iqm_interval(&few), interval(&[&few], |s| iqm(&s[0])));
        assert_eq!(stratified_iqm_interval(&[&few, &many]), interval(&[&few, &many], |s| iqm(&s.concat())));
        let [low, high] = iqm_interval(&values(5000));
        let [centre, error] = [iqm(&values(5000)), deviation(&values(5000)) / 5000f64.sqrt()];
        assert!(low < centre && centre < high && high - low < 6.0 * error, "{low} to {high} around {centre}");
    }

    #[test]
    fn an_interval_of_a_ratio_does_not_depend_on_units_and_is_turned_over_with_it() {
        let (a, b) = ([1.86, 2.25, 3.47, 3.21, 1.94], [0.59, 0.72, 0.77, 0.75, 0.72]);
        let [low, high] = ratio_interval(&a, &b).unwrap();
        // The logarithm's standard error is 0.138, Student's factor at 4.9 degrees of freedom 2.56.
        let ratio = mean(&a) / mean(&b);
        assert!(((low / ratio).ln() + 0.354).abs() < 0.01 && ((high / ratio).ln() - 0.354).abs() < 0.01);
        let [turned_high, turned_low] = ratio_interval(&b, &a).unwrap().map(|end| 1.0 / end);
        let [scaled_low, _] = ratio_interval(&a.map(|value| 1e3 * value), &b).unwrap();
        for (found, same) in [(turned_low, low), (turned_high, high), (scaled_low, 1e3 * low)] {
            assert!((found / same - 1.0).abs() < 1e-9, "{found} {same}");
        }
        assert_eq!((ratio_interval(&a, &[1.0]), ratio_interval(&a, &[-1.0, 0.5])), (None, None));
    }

    #[test]
    fn too_few_values_are_no_number() {
        assert!(quantile(&[], 0.9).is_nan() && (quantile(&[3.0, 1.0, 2.0], 0.9) - 2.8).abs() < 1e-12);
        assert!(mean(&[]).is_nan() && median(&[]).is_nan());
        let infinite = [f64::INFINITY, 1.0, f64::INFINITY, f64::INFINITY];
        assert_eq!(
            [0.0, 0.5, 0.8, 1.0].map(|share| quantile(&infinite, share)),
            [1.0, f64::INFINITY, f64::INFINITY, f64::INFINITY]
        );
        assert_eq!(median(&[f64::NEG_INFINITY; 2]), f64::NEG_INFINITY);
        assert!(deviation(&[]).is_nan() && deviation(&[1.0]).is_nan());
        assert_eq!((median(&[1.0]), iqm(&[1.0]), interval(&[&[1.0]], |s| iqm(&s[0]))), (1.0, 1.0, [1.0, 1.0]));
        assert_eq!(welch_interval(&[1.0], &[1.0, 2.0]), None);
        assert_eq!(welch_interval(&[f64::INFINITY, 1.0], &[1.0, 2.0]), None);
        assert_eq!(welch_interval(&[1e80, -1e80], &[1.0, 2.0]), None);
        assert_eq!(welch_interval(&[1.0, 1.0], &[3.0, 3.0]), Some([-2.0, -2.0]));
    }
}
