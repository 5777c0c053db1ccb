//! The environment: the one loop from an action to torques, and back to a reward.

use aforce::{ActionEntry, ConfigError, Controller, JointVector, Measurement};
use physics::robots::Robot;
use physics::{Plant, Simulation};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::component::Component;
use crate::controller_state::observe_controller;
use crate::drawn::Drawn;
use crate::env_config::EnvConfig;
use crate::expert;
use crate::interval::Interval;
use crate::normal::standard_normal;
use crate::observation::observe_robot;
use crate::observer::Observer;
use crate::reward_terms::RewardTerms;
use crate::sample::Sample;
use crate::sensing::Estimator;
use crate::task::{HELD, Reward, Task};

/// Overlap at which the engine would throw the arm off instead of starting an episode (m).
const LARGEST_OVERLAP: f64 = 1e-3;

/// Starts that are drawn before a scene counts as one without room for the arm.
const MOST_STARTS: u32 = 1000;

/// A task, an arm and an action space.
///
/// Gymnasium's conventions: call [`Env::reset`], then [`Env::step`] until the episode is
/// terminated or truncated. An episode is a function of its seed and its actions, to the last bit and whatever instructions
/// the processor offers. (Jerk-limited set-points are not: their library takes sin, cos and acos from the platform. Nor is the noise
/// of an estimated wrench, whose tails take exp and ln.)
pub struct Env {
    config: EnvConfig,
    task: Box<dyn Task>,
    plant: Plant,
    simulation: Simulation,
    controller: Controller,
    /// What disturbs the running episode.
    drawn: Drawn,
    /// What estimates the external wrench, where that is not known exactly.
    estimator: Option<Estimator>,
    /// What is measured, which noise may set apart from what is.
    y: Measurement,
    observer: Observer,
    /// The terms of the task's reward, each 0.
    nothing_earned: RewardTerms,
    /// Seeds the episodes that are not given a seed.
    episodes: ChaCha8Rng,
    elapsed: u32,
    /// How long the task has stood fulfilled (s).
    held: f64,
}

/// What one action led to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Reward, penalty taken off.
    pub reward: f64,
    /// What adds up to it, but for the price of motion.
    pub reward_terms: RewardTerms,
    /// The price of this action's motion (at least 0), taken off the reward.
    pub motion_cost: f64,
    /// The episode ended in a terminal state, whose value is zero: the simulation diverged, or the arm stopped itself where
    /// episodes end with that ([`EnvConfig::stops`]).
    pub terminated: bool,
    /// The episode reached its horizon, or had the task held and ends there: it would have gone on.
    pub truncated: bool,
    /// Whether the task stands fulfilled.
    pub success: bool,
    /// The simulation diverged.
    pub diverged: bool,
    /// The largest sustained force on the part of the arm that the penalty counts exceeded the limit.
    pub over_limit: bool,
    /// Force penalty of this action, unscaled, whether or not the task takes it off.
    pub penalty: f64,
    /// Energy, force, stiffness, clipping during this action.
    pub interval: Interval,
}

impl Env {
    /// An environment whose unseeded episodes follow from `seed`.
    ///
    /// # Errors
    /// As [`Env::with_task`].
    pub fn new(config: EnvConfig, seed: u64) -> Result<Env, ConfigError> {
        Env::with_task(config.create_task(), config, seed)
    }

    /// As [`Env::new`], with a task of one's own: `config.task` says no more than which disturbances it may have.
    ///
    /// # Errors
    /// As [`EnvConfig::validate`], and if the arm stands in the scene's way at its home pose.
    ///
    /// # Panics
    /// If the task observes more numbers at one time than at another, or names the terms of its reward otherwise.
    pub fn with_task(task: Box<dyn Task>, config: EnvConfig, seed: u64) -> Result<Env, ConfigError> {
        Env::with_robot(config.robot.robot(), task, config, seed)
    }

    /// As [`Env::with_task`], with a robot of one's own in place of `config.robot`.
    ///
    /// # Errors
    /// As [`Env::with_task`].
    ///
    /// # Panics
    /// As [`Env::with_task`].
    pub fn with_robot(robot: Robot, mut task: Box<dyn Task>, config: EnvConfig, seed: u64) -> Result<Env, ConfigError> {
        config.validate()?;
        let controller = Controller::new(&config.space, &config.controller, &robot.arm, task.contact_axis())?;
        let drawn = config.disturbance.draw(0);
        let deviation = config.disturbance.highest_table();
        let plant = Plant { robot, dt: config.controller.dt(), config: config.simulation, deviation };
        let mut simulation = task.reset(&plant, &mut ChaCha8Rng::seed_from_u64(0));
        simulation.reset(&plant.robot.home);
        if simulation.overlap() >= LARGEST_OVERLAP {
            let raised = deviation.table_height > 0.0;
            let field = if raised { "env.disturbance.table_height_m" } else { "env.task" };
            let reason = if raised {
                format!("{} m raise the table into the arm at its start; lower it", deviation.table_height)
            } else {
                let parts = simulation.overlapping().join(" and ");
                let (task, robot) = (task.name(), &plant.robot.name);
                format!("the scene of {task} leaves {robot} no room at its home pose: {parts} overlap")
            };
            return Err(ConfigError::Contradiction { field: field.into(), reason });
        }
        let y = simulation.measure();
        let nothing_earned = task.reward(&simulation, &y, None).terms.zeroed();
        let mut env = Env {
            config,
            task,
            plant,
            simulation,
            controller,
            drawn,
            estimator: None,
            y,
            observer: Observer::default(),
            nothing_earned,
            episodes: ChaCha8Rng::seed_from_u64(seed),
            elapsed: 0,
            held: 0.0,
        };
        env.reset(Some(0));
        Ok(env)
    }

    /// Starts an episode and returns its first observation. `Some(seed)` fixes this
    /// episode; `None` takes the next seed of the environment's own sequence.
    ///
    /// # Panics
    /// If the task's scene has no room for the arm around its home pose.
    pub fn reset(&mut self, seed: Option<u64>) -> &[f32] {
        let seed = seed.unwrap_or_else(|| self.episodes.next_u64());
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        self.drawn = self.config.disturbance.draw(seed);
        self.plant.deviation = self.drawn.deviation;
        self.simulation = self.task.reset(&self.plant, &mut rng);
        self.place_arm(&mut rng);
        self.y = self.drawn.sense(&self.simulation);
        self.estimator = self.config.sensing.estimator(seed, self.plant.robot.damping(), &self.y);
        self.controller.reset(&self.y);
        self.drawn.begin(&self.y.bias, self.plant.dt);
        self.elapsed = 0;
        self.held = 0.0;
        self.observe();
        self.observation()
    }

    /// Draws joint angles until they are within their ranges and the arm stands in nothing's way.
    fn place_arm(&mut self, rng: &mut ChaCha8Rng) {
        let (home, arm) = (self.task.start(&self.plant.robot), &self.plant.robot.arm);
        let joints = self.plant.robot.joints;
        for _ in 0..MOST_STARTS {
            let mut q = home.map(|q| q + self.config.initial_noise * standard_normal(rng));
            // A seventh joint that there is not stays where it is.
            q.iter_mut().zip(&home).skip(joints).for_each(|(q, home)| *q = *home);
            if q.iter().zip(arm.range).all(|(q, [low, high])| (low..=high).contains(q)) {
                self.simulation.reset(&q);
                if self.simulation.overlap() < LARGEST_OVERLAP {
                    return;
                }
            }
        }
        panic!("{MOST_STARTS} starts of {} overlap its scene: leave room around the home pose", self.task.name());
    }

    /// Applies one action in [-1, 1]^n for one policy interval: the entries of the action space
    /// ([`aforce::ActionSpace::entries`]), then, where there is a gripper, one whose sign counts: -1 opens, +1 closes.
    ///
    /// # Panics
    /// If `action` has not [`Env::action_dim`] entries.
    pub fn step(&mut self, action: &[f64]) -> Step {
        self.step_watched(action, |_| ())
    }

    /// As [`Env::step`]; `watch` sees every control sample that the simulation lived through.
    ///
    /// # Panics
    /// As [`Env::step`].
    pub fn step_watched(&mut self, action: &[f64], mut watch: impl FnMut(&Sample)) -> Step {
        assert_eq!(action.len(), self.action_dim(), "an action of this environment");
        let (motion, grip) = action.split_at(self.config.space.dim());
        let grip = grip.first().copied().unwrap_or(0.0);

        self.controller.set_goal(motion, &self.y);
        let mut interval = Interval::default();
        let mut diverged = false;
        for _ in 0..self.config.controller.samples_per_action() {
            let commanded = self.controller.update(&self.y);
            let tau = self.drawn.delayed(&commanded);
            let contact = *self.simulation.contact();
            self.simulation.set_push(&self.drawn.push(self.plant.dt));
            let before = self.simulation.joints().1;
            diverged = self.simulation.step(&tau, grip).is_err() || self.controller.faults() > 0;
            if diverged {
                break;
            }
            let y = self.sense(&commanded);
            let given = std::mem::replace(&mut self.y, y);
            let (controller, simulation) = (&self.controller, &self.simulation);
            watch(&Sample { given: &given, contact: &contact, controller, tau: &tau, simulation });
            let qd = (before + self.simulation.joints().1) / 2.0;
            let (contacts, penalty) = (self.simulation.contacts(), &self.config.force_penalty);
            interval.add(&tau, &qd, contacts, &self.controller, penalty, &self.plant);
            interval.watch(&self.config.protection, &self.plant.robot.arm, &self.simulation.joints().1, contacts);
            interval.overlap = interval.overlap.max(self.simulation.deepest_penetration());
            if self.config.stops && interval.stop.is_some() {
                break;
            }
        }
        self.elapsed += 1;
        self.outcome(interval, diverged)
    }

    /// What is measured after the torque `commanded`.
    fn sense(&mut self, commanded: &JointVector) -> Measurement {
        let mut y = self.drawn.sense(&self.simulation);
        if let Some(estimator) = &mut self.estimator {
            // What disturbs a measured force disturbs an estimated one as well.
            let error = y.wrench - self.simulation.contact().filtered;
            y.wrench = estimator.update(commanded, &y, self.plant.dt) + error;
        }
        y
    }

    fn outcome(&mut self, interval: Interval, diverged: bool) -> Step {
        let rule = self.config.force_penalty;
        let penalty = rule.for_force(interval.force(rule.of).max);
        let stopped = self.config.stops && interval.stop.is_some();
        let terminated = diverged || stopped;
        if !diverged {
            // After a divergence the last valid observation stays.
            self.observe();
        }
        let reward = if terminated {
            Reward { terms: self.nothing_earned, success: false }
        } else {
            // Rewards go by what is, not by what is measured.
            self.task.reward(&self.simulation, &self.simulation.measure(), penalty)
        };
        let (now, first) = (reward.terms.zeroed(), self.nothing_earned);
        assert_eq!(now, first, "terms of {}'s reward, now and at first", self.task.name());
        self.held = if reward.success { self.held + interval.time } else { 0.0 };
        let ends = self.config.ends_on_success && self.held > HELD - 1e-9;
        let motion_cost = self.config.motion_price * interval.energy.absolute;
        Step {
            reward: reward.terms.sum() - motion_cost,
            reward_terms: reward.terms,
            motion_cost,
            terminated,
            truncated: !terminated && (ends || self.elapsed >= self.config.horizon),
            success: reward.success,
            diverged,
            over_limit: penalty.is_some(),
            penalty: penalty.unwrap_or(0.0),
            interval,
        }
    }

    fn observe(&mut self) {
        self.observer.begin();
        self.task.observe(&self.simulation, &self.y, &mut self.observer);
        observe_robot(&self.simulation, &self.y, &mut self.observer);
        if self.config.observation.controller {
            observe_controller(&self.controller, &self.y, &mut self.observer);
        }
        let (values, names) = (self.observation().len(), self.observation_components().len());
        assert_eq!(values, names, "numbers that {} observes, now and at first", self.task.name());
    }

    /// The last observation: object part, proprioception, then the controller's state where it is observed; unscaled.
    pub fn observation(&self) -> &[f32] {
        self.observer.values()
    }

    /// Names and scales of the observation's components, in order.
    pub fn observation_components(&self) -> &[Component] {
        self.observer.components()
    }

    /// What the terms of [`Step::reward_terms`] are for, in order.
    pub fn reward_terms(&self) -> impl Iterator<Item = &'static str> {
        self.nothing_earned.names()
    }

    /// What each entry of an action means, in order: the controller's, then the gripper's.
    pub fn action_entries(&self) -> Vec<ActionEntry> {
        let mut entries = self.config.space.entries(&self.config.controller);
        if self.task.has_gripper() {
            let (unit, frame) = ("sign", "-1 opens, +1 closes");
            entries.push(ActionEntry { name: "gripper", unit, frame, low: -1.0, high: 1.0 });
        }
        entries
    }

    /// Numbers in an action: the controller's, then the gripper's.
    pub fn action_dim(&self) -> usize {
        self.config.space.dim() + usize::from(self.task.has_gripper())
    }

    /// The configuration.
    pub fn config(&self) -> &EnvConfig {
        &self.config
    }

    /// The task.
    pub fn task(&self) -> &dyn Task {
        self.task.as_ref()
    }

    /// The robot.
    pub fn robot(&self) -> &Robot {
        &self.plant.robot
    }

    /// The plant, to look at.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The controller, to look at.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// The last measurement.
    pub fn measurement(&self) -> &Measurement {
        &self.y
    }

    /// The scripted expert's action in the present state.
    pub fn expert_action(&self) -> Vec<f64> {
        let waypoint = self.task.expert(&self.simulation, &self.y);
        let mut action = expert::action_towards(
            &waypoint,
            &self.controller,
            &self.config.controller,
            &self.y,
            self.task.contact_axis(),
        );
        if self.task.has_gripper() {
            action.push(waypoint.grip);
        }
        action
    }

    /// Position of the environment's own sequence of episode seeds, to be saved.
    pub fn episode_stream(&self) -> ChaCha8Rng {
        self.episodes.clone()
    }

    /// Continues a saved sequence of episode seeds.
    pub fn set_episode_stream(&mut self, stream: ChaCha8Rng) {
        self.episodes = stream;
    }
}

#[cfg(test)]
mod tests;
