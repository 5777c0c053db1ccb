//! Random settings: the candidates of a search.

use aforce::Scale;
use aforce::record::overlay;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;
use settings::nested;
use toml::{Table, Value};

/// Maximum number of draws for one candidate: a draw with which a run cannot be configured is repeated.
const TRIES: u32 = 200;

/// Candidates of a group: the group as it stands, and `count - 1` with settings drawn at random.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Draws {
    count: u16,
    /// The same seed, count and ranges give the same candidates.
    seed: u64,
    /// What each setting is drawn from, by the setting's dotted key.
    ranges: Table,
}

/// Bounds between which a setting is drawn: two numbers, or two lists of equal length whose entries are drawn independently.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Range {
    low: Bound,
    high: Bound,
    /// Whether the number or its logarithm is uniform.
    scale: Scale,
}

#[derive(Deserialize, Clone)]
#[serde(untagged)]
enum Bound {
    One(f64),
    Each(Vec<f64>),
}

impl Draws {
    /// The dotted keys of what is drawn.
    pub fn keys(&self) -> impl Iterator<Item = &String> {
        self.ranges.keys()
    }

    /// The candidates, as name and settings. `accepts` returns an error if a run cannot have the settings; these are drawn again.
    ///
    /// # Errors
    /// If the count is 0, a range is invalid, or all draws for a candidate are refused.
    pub fn candidates(
        &self,
        mut accepts: impl FnMut(&Table) -> Result<(), String>,
    ) -> Result<Vec<(String, Table)>, String> {
        if self.count == 0 {
            return Err("draws.count = 0: must be at least 1".into());
        }
        let ranges: Vec<(&String, Range)> = self
            .ranges
            .iter()
            .map(|(key, range)| Ok((key, Range::read(key, range)?)))
            .collect::<Result<_, String>>()?;
        let drawn = |rng: &mut ChaCha8Rng| {
            let mut settings = Table::new();
            for (key, range) in &ranges {
                overlay(&mut settings, nested(key, range.draw(rng)));
            }
            settings
        };
        let mut candidates = vec![("draw-0".to_string(), Table::new())];
        for index in 1..self.count {
            let mut problem = String::new();
            // Each candidate draws from a stream of its own. So two groups that begin with the same ranges draw the same values for these,
            // whatever ranges follow, unless one of them refuses a candidate.
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(index.into());
            let accepted = (0..TRIES).map(|_| drawn(&mut rng)).find(|settings| match accepts(settings) {
                Ok(()) => true,
                Err(reason) => {
                    problem = reason;
                    false
                }
            });
            let settings =
                accepted.ok_or_else(|| format!("draws: none of {TRIES} candidates can run, the last: {problem}"))?;
            candidates.push((format!("draw-{index}"), settings));
        }
        Ok(candidates)
    }
}

impl Range {
    fn read(key: &str, range: &Value) -> Result<Self, String> {
        let wrong = |problem: &str| format!("draws.ranges.{key:?}: {problem}");
        let range: Self = range.clone().try_into().map_err(|error: toml::de::Error| wrong(error.message()))?;
        let pairs = range.pairs().ok_or_else(|| wrong("low and high are not of the same length"))?;
        let lowest = if range.scale == Scale::Log { f64::MIN_POSITIVE } else { f64::MIN };
        match pairs.iter().find(|(low, high)| !(lowest <= *low && low <= high && high.is_finite())) {
            Some((low, high)) => Err(wrong(&format!(
                "from {low} to {high}: low must be at most high{}",
                if range.scale == Scale::Log { ", and above 0 on a log scale" } else { "" }
            ))),
            None => Ok(range),
        }
    }

    /// Low and high of each entry.
    fn pairs(&self) -> Option<Vec<(f64, f64)>> {
        match (&self.low, &self.high) {
            (Bound::One(low), Bound::One(high)) => Some(vec![(*low, *high)]),
            (Bound::Each(low), Bound::Each(high)) if low.len() == high.len() => {
                Some(low.iter().copied().zip(high.iter().copied()).collect())
            }
            _ => None,
        }
    }

    /// A random value, rounded to three significant digits so that a run's `config.toml` is easy to read.
    fn draw(&self, rng: &mut ChaCha8Rng) -> Value {
        let mut number = |(low, high): (f64, f64)| {
            let value = self.scale.between(low, high, rng.random());
            Value::Float(format!("{value:.2e}").parse::<f64>().expect("a number").clamp(low, high))
        };
        let pairs = self.pairs().expect("checked when it was read");
        match self.low {
            Bound::One(_) => number(pairs[0]),
            Bound::Each(_) => Value::Array(pairs.into_iter().map(number).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draws(text: &str) -> Draws {
        toml::from_str(text).unwrap()
    }

    const TWO: &str = "count = 400\nseed = 1\n[ranges]\n\
        'a.b' = { low = 1, high = 100, scale = 'log' }\n\
        c = { low = [0.0, 5.0], high = [1.0, 5.0], scale = 'linear' }";

    #[test]
    fn candidates_fill_their_ranges_and_the_first_is_the_group_itself() {
        let candidates = draws(TWO).candidates(|_| Ok(())).unwrap();
        assert_eq!((candidates.len(), candidates[0].0.as_str(), candidates[0].1.len()), (400, "draw-0", 0));
        let b: Vec<f64> = candidates[1..].iter().map(|(_, s)| s["a"]["b"].as_float().unwrap()).collect();
        assert!(b.iter().all(|b| (1.0..=100.0).contains(b)));
        // Half of the 399 values are expected below the geometric mean, 10: about 200, standard deviation 10.
        let low = b.iter().filter(|b| **b < 10.0).count();
        assert!((150..250).contains(&low), "{low}");
        let c = |i: usize| candidates[i].1["c"].as_array().unwrap().clone();
        assert!((0.0..=1.0).contains(&c(7)[0].as_float().unwrap()) && c(7)[1].as_float() == Some(5.0));
        assert_ne!(c(7)[0], c(8)[0]);
        assert_eq!(candidates, draws(TWO).candidates(|_| Ok(())).unwrap());
    }

    #[test]
    fn what_is_searched_in_every_space_is_searched_alike() {
        let more = format!("{TWO}\nd = {{ low = 0, high = 1, scale = 'linear' }}");
        let shared = |text: &str| {
            let candidates = draws(text).candidates(|_| Ok(())).unwrap();
            candidates.into_iter().skip(1).map(|(_, s)| (s["a"]["b"].clone(), s["c"].clone())).collect::<Vec<_>>()
        };
        assert_eq!(shared(TWO), shared(&more));
    }

    #[test]
    fn what_is_refused_is_drawn_anew() {
        let large = |settings: &Table| {
            if settings["a"]["b"].as_float() > Some(50.0) { Ok(()) } else { Err("too small".into()) }
        };
        let candidates = draws(TWO).candidates(large).unwrap();
        assert!(candidates[1..].iter().all(|(_, settings)| large(settings).is_ok()));
        let error = draws(TWO).candidates(|_| Err("unstable".into())).unwrap_err();
        assert!(error.contains("200 candidates") && error.contains("unstable"), "{error}");
    }

    #[test]
    fn a_range_upside_down_is_named() {
        for (range, word) in [
            ("{ low = 2, high = 1, scale = 'log' }", "from 2 to 1"),
            ("{ low = 0, high = 1, scale = 'log' }", "above 0"),
            ("{ low = [1, 2], high = [3], scale = 'log' }", "length"),
            ("{ low = 1, high = 2, scale = 'cubic' }", "cubic"),
            ("{ low = 1, high = inf, scale = 'linear' }", "inf"),
        ] {
            let text = format!("count = 3\nseed = 1\n[ranges]\n'x.y' = {range}");
            let error = draws(&text).candidates(|_| Ok(())).unwrap_err();
            assert!(error.contains("x.y") && error.contains(word), "{error}");
        }
    }
}
