//! The exact rank-sum test of two small samples (Wilcoxon, Mann and Whitney), and what follows from it for several.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::statistics::mean;

/// Resamples behind a smallest detectable difference, and the steps of the bisection that finds it.
const RESAMPLES: usize = 500;
const HALVINGS: usize = 20;

/// Two-sided p of the hypothesis that `a` and `b` are drawn alike: twice the rarer tail of the sum of `a`'s ranks, over every
/// way to split the ranks. Tied values share their ranks; infinity, for what never happened, is the largest value. 1 if one is
/// empty.
pub fn p_value(a: &[f64], b: &[f64]) -> f64 {
    stratified_p_value(&[[a, b]])
}

/// The same of several `strata`, each a pair of samples that are drawn alike within it and may differ from those of the others:
/// the ranks are given within each stratum, and the sums of the first samples' ranks are added up. 1 if there is no stratum.
pub fn stratified_p_value(strata: &[[&[f64]; 2]]) -> f64 {
    let (mut of_first, mut splits) = (0, vec![1.0]);
    for [a, b] in strata {
        let ranks = doubled_ranks(a, b);
        of_first += ranks[..a.len()].iter().sum::<usize>();
        splits = convolved(&splits, &splits_by_sum(&ranks, a.len()));
    }
    let count = |sums: &[f64]| sums.iter().sum::<f64>();
    let rarer = count(&splits[..=of_first]).min(count(&splits[of_first..]));
    (2.0 * rarer / count(&splits)).min(1.0)
}

/// Element s is the number of ways to choose `chosen` of `ranks` with the sum s. Counts are exact up to 2^53; to choose
/// 20 of 40 there are 1.4e11 ways.
fn splits_by_sum(ranks: &[usize], chosen: usize) -> Vec<f64> {
    let sums = ranks.iter().sum::<usize>() + 1;
    let mut splits = vec![vec![0.0; sums]; chosen + 1];
    splits[0][0] = 1.0;
    for &rank in ranks {
        for size in (0..chosen).rev() {
            let [fewer, more] = splits.get_disjoint_mut([size, size + 1]).expect("two sizes");
            more[rank..].iter_mut().zip(fewer).for_each(|(more, fewer)| *more += *fewer);
        }
    }
    splits.swap_remove(chosen)
}

/// Counts, by their sum, of all pairs of a choice counted in `a` and one counted in `b`.
fn convolved(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0; a.len() + b.len() - 1];
    for (at, &of_a) in a.iter().enumerate().filter(|(_, count)| **count > 0.0) {
        sums[at..].iter_mut().zip(b).for_each(|(sum, of_b)| *sum += of_a * of_b);
    }
    sums
}

/// Twice the rank of each value, of `a` and then of `b`: whole numbers with ties too.
fn doubled_ranks(a: &[f64], b: &[f64]) -> Vec<usize> {
    let all = || a.iter().chain(b);
    let rank =
        |value: &f64| all().filter(|other| *other < value).count() + all().filter(|other| *other <= value).count();
    all().map(|value| rank(value) + 1).collect()
}

/// The p of several tests, corrected so that a level holds for all of them together (family-wise error rate; Holm, 1979).
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&i, &j| p[i].total_cmp(&p[j]));
    let mut corrected = vec![0.0; p.len()];
    let mut largest: f64 = 0.0;
    for (done, &i) in order.iter().enumerate() {
        largest = largest.max(((p.len() - done) as f64 * p[i]).min(1.0));
        corrected[i] = largest;
    }
    corrected
}

/// The smallest difference with which [`p_value`] is below `level` in four of five such experiments. Both samples are
/// redrawn, as large as they are, from the residuals of both (each value less its sample's mean), and one is shifted.
/// Infinite if no difference would do; `None` if a value is not finite, or there is no spread to draw from.
pub fn smallest_detectable(a: &[f64], b: &[f64], level: f64) -> Option<f64> {
    // A sample lies closer to its own mean than to the true one: the factor makes up for that.
    let left_of = |sample: &[f64]| {
        let (centre, n) = (mean(sample), sample.len() as f64);
        sample.iter().map(|x| (x - centre) * (n / (n - 1.0)).sqrt()).collect::<Vec<_>>()
    };
    let left = [a, b].map(left_of).concat();
    if left.iter().any(|x| !x.is_finite()) || left.iter().all(|&x| x == 0.0) {
        return None;
    }
    let seen = |shift: f64| {
        // The same draws for every shift: the share rises with it.
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut draw =
            |n: usize, by: f64| (0..n).map(|_| by + left[rng.random_range(0..left.len())]).collect::<Vec<_>>();
        let real = (0..RESAMPLES).filter(|_| p_value(&draw(a.len(), shift), &draw(b.len(), 0.0)) < level).count();
        5 * real >= 4 * RESAMPLES
    };
    let spread = left.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
    // Beyond this every value of one sample lies above all of the other.
    let (mut low, mut high) = (0.0, 2.0 * spread * (1.0 + 1e-9));
    if !seen(high) {
        return Some(f64::INFINITY);
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if seen(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(text: &str) -> Vec<f64> {
        text.split_whitespace().map(|cell| cell.parse().unwrap()).collect()
    }

    /// `scripts/statistics_reference.py` asks SciPy.
    #[test]
    fn agrees_with_scipy() {
        let mut reader = csv::Reader::from_reader(&include_bytes!("../reference/rank_test.csv")[..]);
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        for row in &rows {
            assert!((p_value(&numbers(&row[0]), &numbers(&row[1])) - numbers(&row[2])[0]).abs() < 1e-9, "{row:?}");
        }
        assert_eq!(rows.len(), 9);
        assert_eq!(p_value(&[], &[1.0]), 1.0);
    }

    /// `scripts/statistics_reference.py` goes through every way to split each stratum.
    #[test]
    fn strata_agree_with_every_split_counted() {
        let mut reader = csv::Reader::from_reader(&include_bytes!("../reference/stratified.csv")[..]);
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        for row in &rows {
            let strata: Vec<[Vec<f64>; 2]> = row[0]
                .split(';')
                .map(|stratum| stratum.split_once('|').map(|(a, b)| [numbers(a), numbers(b)]).unwrap())
                .collect();
            let borrowed: Vec<[&[f64]; 2]> = strata.iter().map(|[a, b]| [a.as_slice(), b.as_slice()]).collect();
            assert!((stratified_p_value(&borrowed) - numbers(&row[1])[0]).abs() < 1e-9, "{row:?}");
        }
        assert_eq!(rows.len(), 4);
        assert_eq!(stratified_p_value(&[]), 1.0);
    }

    #[test]
    fn holm_by_hand() {
        let corrected = holm(&[0.04, 0.01, 0.03, 0.6]);
        let expected = [0.09, 0.04, 0.09, 0.6];
        assert!(corrected.iter().zip(expected).all(|(p, e)| (p - e).abs() < 1e-12), "{corrected:?}");
        assert_eq!(holm(&[0.7, 0.6]), [1.0, 1.0]);
    }

    /// The result is compared with the t test's, which for normal samples of ten and a standard deviation of 14 is 18.5.
    #[test]
    fn more_seeds_detect_less() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut sample = |n: usize| -> Vec<f64> {
            // Twelve uniform numbers are nearly normal.
            (0..n).map(|_| 14.0 * ((0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0)).collect()
        };
        assert_eq!(smallest_detectable(&sample(3), &sample(3), 0.05), Some(f64::INFINITY), "p is 0.1 at least");
        let sides = [sample(10), sample(10)];
        let ten = smallest_detectable(&sides[0], &sides[1], 0.05).unwrap();
        let five = smallest_detectable(&sample(5), &sample(5), 0.05).unwrap();
        assert!((12.0..26.0).contains(&ten) && five > 1.2 * ten, "{ten} {five}");
        // Other draws of the same residuals, scaled as for samples of ten, show the difference in four cases of five.
        let apart = |side: &Vec<f64>| side.iter().map(|x| x - mean(side)).collect::<Vec<_>>();
        let left = sides.each_ref().map(apart).concat();
        let wider = (10.0_f64 / 9.0).sqrt();
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut draw = |by: f64| (0..10).map(|_| by + wider * left[rng.random_range(0..20)]).collect::<Vec<f64>>();
        let mut power = |by: f64| (0..2000).filter(|_| p_value(&draw(by), &draw(0.0)) < 0.05).count();
        assert!((1500..1700).contains(&power(ten)), "four of five");
        assert!(power(0.9 * ten) < 1500);
        assert_eq!(smallest_detectable(&[1.0, f64::INFINITY], &[2.0, 3.0], 0.05), None);
        assert_eq!(smallest_detectable(&[1.0; 5], &[2.0; 5], 0.05), None);
    }
}
