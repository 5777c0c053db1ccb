//! The interface of a task.

use aforce::{Measurement, Pose, Vector3};
use nalgebra::UnitVector3;
use physics::camera::{Camera, Decal};
use physics::robots::Robot;
use physics::{Plant, Simulation};
use rand_chacha::ChaCha8Rng;

use crate::force_sensor::Feel;
use crate::observer::Observer;
use crate::reward_terms::RewardTerms;
use crate::start::Start;

/// A task: its scene and randomness, observation, reward and script. [`crate::Env::step`] drives it.
pub trait Task: Send {
    /// Builds the scene of one episode and draws everything random from `rng`. The caller puts the arm in place, as
    /// [`start`](Self::start) says.
    fn reset(&mut self, plant: &Plant, rng: &mut ChaCha8Rng) -> Simulation;

    /// How the episode that was last [`reset`](Self::reset) starts: posture, fingers, what they hold.
    fn start(&self, robot: &Robot) -> Start {
        Start::at(robot.home)
    }

    /// Puts the task's own joints where the episode starts, for those that do not start at zero ([`Simulation::set_joint`]). Called after
    /// the arm was put in place, once for each start that is tried.
    fn arrange(&self, _simulation: &mut Simulation) {}

    /// The name with which the task is registered; captions and messages use it too.
    fn name(&self) -> &'static str;

    /// Whether the last entry of an action drives a gripper.
    fn has_gripper(&self) -> bool;

    /// Direction (world, unit) in which a surface pushes on the tool at the present place: the axis of the force in the `-force`
    /// action spaces, asked for before every action. By default up.
    fn contact_normal(&self, _simulation: &Simulation, _y: &Measurement) -> UnitVector3<f64> {
        Vector3::z_axis()
    }

    /// About which point and in which axes force and torque are observed ([`ObservationOptions::force`](crate::ObservationOptions::force)).
    fn feel(&self) -> Feel {
        Feel::default()
    }

    /// Puts the object part of an observation: the same entries in the same order every time.
    fn observe(&self, simulation: &Simulation, y: &Measurement, out: &mut Observer);

    /// Puts what a critic may know of the task and a policy does not see: the same entries in the same order every time. By default
    /// nothing.
    fn observe_privileged(&self, _simulation: &Simulation, _y: &Measurement, _out: &mut Observer) {}

    /// Reward of one action. It is called once after each action and after its [`observe`](Self::observe), as in
    /// robosuite: what a reward changes in the task is observed one action later. It is not called if the simulation
    /// diverged or the arm stopped itself: the action earns nothing then. `penalty` is the action's force penalty (at
    /// least 0), which a task takes off in its own scale or ignores; `None` if the force stayed within its limit. The
    /// terms have the same names in the same order every time. An environment asks for them once before its first
    /// episode.
    fn reward(&mut self, simulation: &Simulation, y: &Measurement, penalty: Option<f64>) -> Reward;

    /// Whether the task can no longer be fulfilled, as when an object has fallen from the table; asked after each [`reward`](Self::reward).
    /// The episode is then terminated: to a learner what follows is worth nothing. No built-in task is ever lost.
    fn lost(&self, _simulation: &Simulation, _y: &Measurement) -> bool {
        false
    }

    /// The next waypoint of a scripted expert. The method may be called several times between two actions and returns the same each time.
    /// The time since the start is [`Simulation::time`]; the script's memory is updated in [`advance`](Self::advance).
    fn expert(&self, simulation: &Simulation, y: &Measurement) -> Waypoint;

    /// Called once after every action, before the observation, whether or not the script plays. Updates what a script, an observation or a
    /// reward remembers, such as the phase of a search and the time when it began.
    fn advance(&mut self, _simulation: &Simulation, _y: &Measurement) {}

    /// How much of the work is done, 0 to 1; `None` in a task without such a measure.
    fn progress(&self) -> Option<f64> {
        None
    }

    /// What success is, for captions: a verb and its object.
    fn achievement(&self) -> &'static str {
        "fulfils the task"
    }

    /// The camera from which the task is shown.
    fn camera(&self) -> Camera;

    /// What is drawn besides the simulated shapes.
    fn decals(&self) -> Vec<Decal> {
        vec![]
    }
}

/// A task counts as held once it has stood fulfilled for this long (s).
pub(crate) const HELD: f64 = 1.0;

/// What one action earned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reward {
    /// The terms that add up to the reward, in the task's own scale.
    pub terms: RewardTerms,
    /// Whether the task stands fulfilled now.
    pub success: bool,
}

/// Where a scripted expert wants the tool to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// Pose of the tool point (m, world).
    pub pose: Pose,
    /// Gripper command: -1 opens, +1 closes.
    pub grip: f64,
    /// Force with which the surface should push on the tool along [`Task::contact_normal`] (N). Where it is above 0, the pose's
    /// position along that axis does not count.
    pub force: f64,
}
