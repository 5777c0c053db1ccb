//! The loop that turns an action into torques, control sample by control sample, and the outcome into a reward.

use aforce::{JointVector, Measurement};

use super::{Env, Running};
use crate::interval::Interval;
use crate::reward_terms::RewardTerms;
use crate::sample::Sample;
use crate::step::Step;
use crate::task::{HELD, Reward};

impl Env {
    /// Applies one action in [-1, 1]^n for one policy interval: the entries of the action space
    /// ([`aforce::ActionSpace::entries`]), then, with a gripper, one entry of which only the sign counts: -1 opens, +1 closes.
    ///
    /// # Panics
    /// If `action` has not [`Env::action_dim`] entries. If the task observes more or fewer numbers than at first, names
    /// the terms of its reward differently than at first, or returns a term that is not finite.
    pub fn step(&mut self, action: &[f64]) -> Step {
        self.step_watched(action, |_| ())
    }

    /// As [`Env::step`]. `watch` is called after every control sample, except one in which the simulation diverged.
    ///
    /// # Panics
    /// As [`Env::step`].
    pub fn step_watched(&mut self, action: &[f64], mut watch: impl FnMut(&Sample)) -> Step {
        self.begin(action);
        while self.advance(&mut watch) {}
        self.end()
    }

    /// The first part of a [`step`](Env::step), for a caller that shows control samples as they are simulated: sets the
    /// action. Call [`Env::advance`] until it returns false, then [`Env::end`].
    ///
    /// # Panics
    /// If `action` has not [`Env::action_dim`] entries.
    pub fn begin(&mut self, action: &[f64]) {
        assert_eq!(action.len(), self.action_dim(), "an action of this environment");
        let (motion, grip) = action.split_at(self.config.space.dim());
        self.wait();
        self.running.grip = grip.first().copied().unwrap_or(0.0);
        self.controller.set_goal(motion, &self.y);
        self.last_action.iter_mut().zip(action).for_each(|((name, last), &entry)| *last = taken(name, entry));
    }

    /// As [`Env::begin`], but without an action: goal, commanded stiffness and gripper command stay as they are.
    pub fn wait(&mut self) {
        self.controller.set_contact_axis(self.task.contact_normal(&self.simulation, &self.y));
        let left = self.config.controller.samples_per_action();
        self.running = Running { left, grip: self.running.grip, ..Running::default() };
    }

    /// Simulates one control sample of the action under way, and returns whether another one follows. `watch` is called
    /// after the sample, unless the simulation diverged in it.
    pub fn advance(&mut self, watch: impl FnOnce(&Sample)) -> bool {
        let running = &mut self.running;
        let commanded = self.controller.update(&self.y);
        let most = self.plant.robot.arm.torque_max.into();
        let tau = self.drawn.acting(&commanded, &self.y.bias, &most);
        let contact = *self.simulation.contact();
        self.simulation.set_push(&self.drawn.push(self.plant.dt));
        let before = self.simulation.joints().1;
        running.left = running.left.saturating_sub(1);
        running.diverged = self.simulation.step(&tau, running.grip).is_err() || self.controller.faults() > 0;
        if running.diverged {
            running.left = 0;
            return false;
        }
        let y = self.sense(&commanded);
        let given = std::mem::replace(&mut self.y, y);
        let (controller, simulation) = (&self.controller, &self.simulation);
        watch(&Sample { given: &given, contact: &contact, controller, tau: &tau, simulation });
        let qd = (before + self.simulation.joints().1) / 2.0;
        let (contacts, penalty) = (self.simulation.contacts(), &self.config.force_penalty);
        let interval = &mut self.running.interval;
        interval.add(&tau, &qd, contacts, &self.controller, penalty, &self.plant);
        interval.watch(&self.config.protection, &self.plant.robot.arm, &self.simulation.joints().1, contacts);
        interval.follow(&mut self.motion, self.simulation.tool_velocity(), self.plant.dt);
        interval.overlap = interval.overlap.max(self.simulation.deepest_penetration());
        if self.config.stops && interval.stop.is_some() {
            self.running.left = 0;
        }
        self.running.left > 0
    }

    /// The last part of a [`step`](Env::step): the outcome of the action under way.
    ///
    /// # Panics
    /// If the task breaks what [`Env::step`] asks of its observation and its reward.
    pub fn end(&mut self) -> Step {
        let Running { interval, diverged, .. } = self.running;
        self.elapsed += 1;
        self.outcome(interval, diverged)
    }

    /// The measurement after a control sample in which `commanded` (Nm) was the commanded torque.
    fn sense(&mut self, commanded: &JointVector) -> Measurement {
        let mut y = self.drawn.sense(&self.simulation);
        if let Some(estimator) = &mut self.estimator {
            // Noise and bias of a measured force are added to an estimated one as well.
            let error = y.wrench - self.simulation.contact().filtered;
            y.wrench = estimator.update(commanded, &y, self.plant.dt) + error;
        }
        y
    }

    pub(super) fn outcome(&mut self, interval: Interval, diverged: bool) -> Step {
        let rule = self.config.force_penalty;
        let penalty = rule.for_force(interval.force(rule.of).max);
        let stopped = self.config.stops && interval.stop.is_some();
        if !diverged {
            self.task.advance(&self.simulation, &self.y);
            // After a divergence the last valid observation stays.
            self.observe();
        }
        let (reward, lost) = if diverged || stopped {
            (Reward { terms: self.nothing_earned, success: false }, false)
        } else {
            // Rewards depend on the true state, not on the disturbed measurement.
            let y = self.simulation.measure();
            (self.task.reward(&self.simulation, &y, penalty), self.task.lost(&self.simulation, &y))
        };
        let terminated = diverged || lost || (stopped && self.config.stop_price.is_none());
        self.check(&reward.terms);
        self.held = if reward.success { self.held + interval.time } else { 0.0 };
        let ends = self.config.ends_on_success && self.held > HELD - 1e-9;
        let motion_cost = self.config.motion_price * interval.energy.absolute;
        let stop_cost = self.config.stop_price.filter(|_| stopped).unwrap_or_default();
        Step {
            reward: reward.terms.sum() - motion_cost - stop_cost,
            reward_terms: reward.terms,
            motion_cost,
            stop_cost,
            terminated,
            truncated: !terminated && (stopped || ends || self.elapsed >= self.config.horizon),
            success: reward.success,
            diverged,
            over_limit: penalty.is_some(),
            penalty: penalty.unwrap_or(0.0),
            interval,
        }
    }

    /// Panics unless a reward has the terms of the first reward, each finite.
    fn check(&self, terms: &RewardTerms) {
        let (task, action) = (self.task.name(), self.elapsed);
        assert!(
            terms.zeroed() == self.nothing_earned,
            "task {task}: the reward of action {action} has the terms {:?}, the first had {:?}; the same ones are wanted every time",
            terms.names().collect::<Vec<_>>(),
            self.nothing_earned.names().collect::<Vec<_>>()
        );
        if let Some((name, value)) = terms.not_finite() {
            panic!(
                "task {task}: the term {name:?} of the reward of action {action} is {value}: a finite number is wanted"
            );
        }
    }
}

/// The value with which an action's entry acts: clipped to [-1, 1], a NaN as 0. In the entry of the force a NaN acts as -1, no force.
fn taken(name: &str, entry: f64) -> f64 {
    match entry.is_nan() {
        true if name == "normal_force" => -1.0,
        true => 0.0,
        false => entry.clamp(-1.0, 1.0),
    }
}
