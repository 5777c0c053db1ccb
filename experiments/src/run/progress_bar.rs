//! What a person sees while a run goes on: a bar in a terminal, and a line and new curves after every evaluation.

use std::io::IsTerminal;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use output::program;
use output::statistics::mean;
use tasks::Outcome;

use crate::run::rollout::mean_of_column;

/// Progress of a run, on stderr. No line is wider than a terminal of 80 columns.
pub struct RunProgress<'a> {
    bar: ProgressBar,
    /// Draws the learning curves.
    draw: &'a dyn Fn(),
    quiet: bool,
    steps: u64,
    /// The last evaluation, or the start: its time and action.
    since: Instant,
    since_step: Option<u64>,
    /// Actions per second up to the last evaluation. `None` before the first, because the random actions at the start are quicker.
    rate: Option<f64>,
    recent: Vec<f64>,
}

/// Episodes in the running mean of the training return.
const RECENT: usize = 20;

impl<'a> RunProgress<'a> {
    /// For a run of `steps` actions; `quiet` prints nothing. `draw` draws its curves after every evaluation.
    pub fn new(steps: u64, quiet: bool, draw: &'a dyn Fn()) -> Self {
        let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr_with_hz(4));
        if quiet || !std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let style = ProgressStyle::with_template("{bar:24} {pos} of {len} actions{wide_msg}");
        bar.set_style(style.expect("a valid template"));
        RunProgress { bar, draw, quiet, steps, since: Instant::now(), since_step: None, rate: None, recent: vec![] }
    }

    /// `step` actions are done.
    pub fn step(&mut self, step: u64) {
        if self.since_step.is_none() {
            (self.since, self.since_step) = (Instant::now(), Some(step - 1));
        }
        self.bar.set_position(step);
    }

    /// A training episode ended with this return.
    pub fn episode(&mut self, total: f64) {
        if self.recent.len() == RECENT {
            self.recent.remove(0);
        }
        self.recent.push(total);
        if let Some(left) = self.left(self.bar.position()) {
            self.bar.set_message(format!(", {left} left"));
        }
    }

    /// An evaluation was made.
    pub fn evaluation(&mut self, step: u64, outcomes: &[Outcome]) {
        let actions = (step - self.since_step.unwrap_or(0)) as f64;
        self.rate = Some(actions / self.since.elapsed().as_secs_f64().max(1e-9));
        (self.since, self.since_step) = (Instant::now(), Some(step));
        self.line(&row(step, outcomes, &self.recent, &self.left(step).unwrap_or_default()));
        (self.draw)();
    }

    /// How long the rest will take, once that is known.
    fn left(&self, step: u64) -> Option<String> {
        self.rate.map(|rate| in_words(self.steps.saturating_sub(step) as f64 / rate.max(1e-9)))
    }

    /// Prints a line above the bar.
    pub fn line(&self, text: &str) {
        if self.quiet {
            return;
        }
        self.bar.suspend(|| program::tell(text));
    }
}

/// An evaluation: the policy's mean action, and the training episodes before it.
fn row(step: u64, outcomes: &[Outcome], training: &[f64], left: &str) -> String {
    let training = if training.is_empty() { String::new() } else { format!(", in training {:.1}", mean(training)) };
    let (success, total) = (100.0 * mean_of_column(outcomes, "success"), mean_of_column(outcomes, "return"));
    format!("{step:>7} actions: return {total:.1}{training}, success {success:.0} %, {left} left")
}

/// A duration (s) to two digits or so.
fn in_words(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round();
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{minutes:.0} min"),
        s if s < 1e9 => format!("{:.0} h {:.0} m", (minutes / 60.0).floor(), minutes % 60.0),
        _ => "long".into(),
    }
}

impl Drop for RunProgress<'_> {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use tasks::columns::Cell;

    use super::*;

    /// A line fits into 80 columns.
    #[test]
    fn a_line_fits_a_terminal() {
        let outcome = Outcome::default().with(&[("return", Cell::Real(-1435.26)), ("success", Cell::Flag(true))]);
        let line = row(1_200_000, &[outcome], &[-1170.32], &in_words(360_000.0));
        assert_eq!(line, "1200000 actions: return -1435.3, in training -1170.3, success 100 %, 100 h 0 m left");
    }

    #[test]
    fn durations_have_the_unit_that_suits_them() {
        let words = [3.4, 89.0, 91.0, 3000.0, 5400.0, 40_000.0, f64::INFINITY].map(in_words);
        assert_eq!(words, ["3 s", "89 s", "2 min", "50 min", "1 h 30 m", "11 h 7 m", "long"]);
    }
}
