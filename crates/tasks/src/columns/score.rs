//! The score of the AI for Industry Challenge (`docs/scoring.md` of intrinsic-dev/aic at commit db40abc), which is about insertion.

use super::Over::{Baseline, End};
use super::Statistic::Mean;
use super::parts::Part;
use super::{Cell, Column, Parts, number, summarised};

pub(super) const COLUMNS: &[Column] = &[Column::new(
    "aic_score",
    "",
    "score of the AI for Industry Challenge, -35 to 100, over the time until the first success, or over the whole episode if there is none; the \
     points for coming near are left out",
    |e| Cell::Real(score(e)),
)
.printed("score of the AI for Industry Challenge")
.of_runs(&[summarised("end_aic_score", End, Mean), number("aic_score", Baseline, Mean)])];

/// Points of a trial that ran, and points of a success.
const RUNS: f64 = 1.0;
const SUCCESS: f64 = 75.0;
/// The most points that a short time earns, and the two times (s) between which the points fall from all to none.
const DURATION: (f64, [f64; 2]) = (12.0, [5.0, 60.0]);
/// The same for the detour: how much longer the tool point's way is than the straight one (m).
const DETOUR: (f64, [f64; 2]) = (6.0, [0.0, 1.0]);
/// The same for the mean jerk (m/s3).
const JERK: (f64, [f64; 2]) = (6.0, [0.0, 50.0]);
/// Points lost if the time with more than 20 N is longer than the second number (s).
const HARD: (f64, f64) = (12.0, 1.0);
/// Points lost if a link short of the wrist touches anything in the scene.
const OFF_LIMITS: f64 = 24.0;

fn score(episode: &Parts) -> f64 {
    let trial = episode.to_success.unwrap_or(episode.whole);
    let earned = episode.to_success.map_or(0.0, |way| SUCCESS + smoothly(&way));
    let (hard, longest) = HARD;
    let pressed = if trial.hard_time > longest { hard } else { 0.0 };
    let strayed = if trial.link_time > 0.0 { OFF_LIMITS } else { 0.0 };
    RUNS + earned - pressed - strayed
}

/// Points for duration, detour and jerk of the motion up to the first success.
fn smoothly(way: &Part) -> f64 {
    let falling = |value: f64, (most, [best, worst]): (f64, [f64; 2])| {
        most * (1.0 - ((value - best) / (worst - best)).clamp(0.0, 1.0))
    };
    let detour = way.path - way.displacement.norm();
    falling(way.time, DURATION) + falling(detour, DETOUR) + way.jerk().map_or(0.0, |jerk| falling(jerk, JERK))
}
