//! An arm that folds upon itself and wedges itself into the scene presses about as hard as in robosuite 1.4.1: quantiles of the
//! force under actions whose entries are all +1 or -1, recorded by `scripts/robosuite_forces.py`.
//!
//! The actions are the same. The starts are not: each simulator draws its own from the same distributions, so only quantiles
//! over all episodes compare.

use std::fmt::Write;

use aforce::ControllerConfig;
use tasks::{Env, EnvConfig, TaskName};

/// Set, the test writes the reference and what it measures here into `results/robosuite/forces.csv`.
const UPDATE: &str = "UPDATE_ROBOSUITE_FORCES";

const REFERENCE: &str = include_str!("reference/robosuite_forces.csv");

/// Seed of the first episode, actions that are drawn for an episode, and how often each is played.
const FIRST: u64 = 1000;
const HOLDS: u64 = 16;
const HOLD: usize = 25;

/// An action: entry i is +1 where bit i of a word is set. The word is number `seed` * `HOLDS` + `hold` of splitmix64 from 0.
fn signs(seed: u64, hold: u64, entries: usize) -> Vec<f64> {
    let mut word = (seed * HOLDS + hold + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    word ^= word >> 31;
    (0..entries).map(|entry| if (word >> entry) & 1 == 1 { 1.0 } else { -1.0 }).collect()
}

/// A row of the reference, or of what is measured here.
struct Forces {
    task: String,
    space: String,
    /// Seeds from [`FIRST`] on.
    episodes: u64,
    /// Entries that are +1, over all holds.
    positive: usize,
    /// Of 90, 99 and 99.9 % of the actions (N).
    quantiles: [f64; 3],
    /// The largest (N).
    max: f64,
    /// Share of the actions above 1, 2 and 5 kN.
    above: [f64; 3],
}

impl Forces {
    fn read(row: &str) -> Forces {
        let cells: Vec<_> = row.split(',').collect();
        let number = |at: usize| cells[at].parse().unwrap();
        Forces {
            task: cells[0].into(),
            space: cells[1].into(),
            episodes: cells[2].parse().unwrap(),
            positive: cells[3].parse().unwrap(),
            quantiles: [4, 5, 6].map(number),
            max: number(7),
            above: [8, 9, 10].map(number),
        }
    }

    fn write(&self) -> String {
        let Forces { task, space, episodes, positive, quantiles: [a, b, c], max, above: [one, two, five] } = self;
        format!("{task},{space},{episodes},{positive},{a:.1},{b:.1},{c:.1},{max:.1},{one:.5},{two:.5},{five:.5}")
    }

    /// The same episodes here.
    fn here(&self) -> Forces {
        let task = TaskName::BUILT_IN.into_iter().find(|task| task.as_str() == self.task).unwrap();
        let controller = ControllerConfig { position_step: 0.05, rotation_step: 0.5, ..ControllerConfig::default() };
        let config = EnvConfig { task, space: self.space.parse().unwrap(), controller, ..EnvConfig::default() };
        let mut env = Env::new(config, 0).unwrap();
        let (mut forces, mut positive) = (vec![], 0);
        for seed in FIRST..FIRST + self.episodes {
            env.reset(Some(seed));
            for hold in 0..HOLDS {
                let action = signs(seed, hold, env.action_dim());
                positive += action.iter().filter(|&&sign| sign > 0.0).count();
                for _ in 0..HOLD {
                    let step = env.step(&action);
                    assert!(!step.diverged, "{} {} seed {seed}", self.task, self.space);
                    forces.push(step.interval.arm.max);
                }
            }
        }
        forces.sort_by(f64::total_cmp);
        Forces {
            task: self.task.clone(),
            space: self.space.clone(),
            episodes: self.episodes,
            positive,
            quantiles: [0.9, 0.99, 0.999].map(|share| quantile(&forces, share)),
            max: forces[forces.len() - 1],
            above: [1e3, 2e3, 5e3]
                .map(|limit| forces.iter().filter(|&&force| force > limit).count() as f64 / forces.len() as f64),
        }
    }
}

/// As numpy's: between two neighbours of a sorted list by their distance.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = share * (sorted.len() - 1) as f64;
    let (low, part) = (at as usize, at.fract());
    sorted[low] + part * (sorted[(low + 1).min(sorted.len() - 1)] - sorted[low])
}

/// Between which the ratio of quantile number `at` here to that of robosuite lies: a factor of 2, but where one jam decides. In one
/// of its episodes of Door with `variable` robosuite presses link 3 9 mm deep into the door's frame, with up to 100 kN for 36 actions:
/// there its 99.9 % bound what is pressed here from above alone.
fn bounds(task: &str, space: &str, at: usize) -> (f64, f64) {
    match (task, space, at) {
        ("door", "variable", 2) => (0.0, 2.0),
        _ => (0.5, 2.0),
    }
}

#[test]
fn a_wedged_arm_presses_as_hard_as_robosuites() {
    let (head, rows) = REFERENCE.split_once('\n').unwrap().1.split_once('\n').unwrap();
    let there: Vec<_> = rows.lines().map(Forces::read).collect();
    assert_eq!(there.len(), 6);
    let here: Vec<_> = there.iter().map(Forces::here).collect();
    let mut table = format!("simulator,{head}\n");
    for (simulator, rows) in [("robosuite", &there), ("here", &here)] {
        rows.iter().for_each(|row| writeln!(table, "{simulator},{}", row.write()).unwrap());
    }
    println!("{table}");
    if std::env::var_os(UPDATE).is_some() {
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/results/robosuite/forces.csv"), table).unwrap();
    }
    for (here, there) in here.iter().zip(&there) {
        let name = format!("{} {}", here.task, here.space);
        assert_eq!(here.positive, there.positive, "{name}: the actions are not those of the reference");
        for (at, (ours, theirs)) in here.quantiles.iter().zip(there.quantiles).enumerate() {
            let ratio = ours / theirs;
            let (least, most) = bounds(&here.task, &here.space, at);
            assert!((least..=most).contains(&ratio), "{name}: {ours:.0} N here, {theirs:.0} N in robosuite");
        }
    }
}
