//! What a person sees while a run goes on: a bar in a terminal, plain lines in a pipe.

use std::io::IsTerminal;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use output::statistics::{mean, mean_of};
use tasks::Outcome;

/// Progress of a run, on stderr.
pub struct RunProgress {
    bar: ProgressBar,
    quiet: bool,
    steps: u64,
    /// Since when the rate is counted, and the action then: the last evaluation, as random actions at the start are quicker.
    since: Instant,
    since_step: Option<u64>,
    recent: Vec<f64>,
}

/// Episodes in the running mean of the training return.
const RECENT: usize = 20;

impl RunProgress {
    /// For a run of `steps` actions; `quiet` shows nothing.
    pub fn new(steps: u64, quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr_with_hz(4));
        if quiet || !std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let style = ProgressStyle::with_template("{bar:24} {pos}/{len} {per_sec} eta {eta} {wide_msg}");
        bar.set_style(style.expect("a valid template"));
        RunProgress { bar, quiet, steps, since: Instant::now(), since_step: None, recent: vec![] }
    }

    /// `step` actions are done.
    pub fn step(&mut self, step: u64) {
        if self.since_step.is_none() {
            self.since_step = Some(step - 1);
            self.bar.reset_elapsed();
        }
        self.bar.set_position(step);
    }

    /// A training episode ended with this return.
    pub fn episode(&mut self, total: f64) {
        if self.recent.len() == RECENT {
            self.recent.remove(0);
        }
        self.recent.push(total);
    }

    /// An evaluation was made.
    pub fn evaluation(&mut self, step: u64, outcomes: &[Outcome]) {
        let elapsed = self.since.elapsed().as_secs_f64();
        let rate = (step - self.since_step.unwrap_or(0)) as f64 / elapsed.max(1e-9);
        (self.since, self.since_step) = (Instant::now(), Some(step));
        let left = (self.steps - step.min(self.steps)) as f64 / rate.max(1e-9);
        let training = mean(&self.recent);
        let text = format!(
            "step {step:>7}  evaluation {:5.1} (success at end {:3.0} %)  training {training:5.1}  {:5.2} J/action  K {:4.0} N/m  {rate:4.0} steps/s  {:.0} min left",
            mean_of(outcomes, |o| o.total),
            100.0 * mean_of(outcomes, |o| f64::from(u8::from(o.success))),
            mean_of(outcomes, |o| o.energy_per_action_j),
            mean_of(outcomes, |o| o.stiffness_translation_n_per_m),
            left / 60.0
        );
        self.bar.set_message(format!("evaluation {:.0}", mean_of(outcomes, |o| o.total)));
        self.line(&text);
    }

    /// Prints a line above the bar.
    pub fn line(&self, text: &str) {
        if self.quiet {
            return;
        }
        self.bar.suspend(|| eprintln!("{text}"));
    }
}

impl Drop for RunProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
