//! Insert: put the peg in the hand into a hole whose place is not known exactly (FORGE's and Factory's `PegInsert`).

mod options;
mod script;

use aforce::{ConfigError, JointVector, Measurement, Pose, Vector3};
use nalgebra::{Translation3, UnitQuaternion};
use physics::camera::Camera;
use physics::gripper::GRIP_SITE;
use physics::model::Model;
use physics::robots::Robot;
use physics::scene::at;
use physics::scenes::insert::{self, DEPTH, Profile, TABLE_HEIGHT, WIDTH};
use physics::{Change, Plant, Simulation};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::disturbance::OwnDisturbance;
use crate::env_config::EnvConfig;
use crate::force_sensor::Feel;
use crate::grasp::{nearest_straight_down, straight_down};
use crate::normal::standard_normal;
use crate::observer::Observer;
use crate::privileged::Privileged;
use crate::start::{Fingers, Start};
use crate::task::{Reward, Task, Waypoint};
use crate::task_kind::TaskKind;
use crate::task_name::TaskName;
use options::Options;
use script::{Script, Seen};

/// What Insert is registered with.
pub(crate) const KIND: TaskKind =
    TaskKind::new(TaskName::INSERT.as_str(), "put a peg into a hole", |config| Ok(Box::new(Insert::new(config)?)))
        .defaults(|env| {
            env.horizon = 200;
            env.initial_noise = 0.0;
            env.observation.force = true;
            env.observation.action = true;
            env.observation.critic = vec![Privileged::Contact, Privileged::Task];
        })
        .takes_options()
        .own_disturbances(&[
            OwnDisturbance { key: "hole_friction", change: Change::BodyFriction("hole"), allowed: [0.0, 10.0] },
            OwnDisturbance { key: "peg_mass", change: Change::BodyMass("peg"), allowed: [0.1, 100.0] },
        ]);

/// Largest offset of the rim's middle from the table's middle, in x and in y (m).
const PLACEMENT: f64 = 0.05;
/// Largest offset of the tool's start from its place above the hole along x, y, z (m), and largest turn about z (rad).
const START: [f64; 3] = [0.02, 0.02, 0.01];
const START_TURN: f64 = std::f64::consts::FRAC_PI_4;
/// Standard deviation of the error of each believed coordinate of the hole (m).
const BELIEF: f64 = 0.001;
/// Range from which the allowed force is drawn (N).
const ALLOWED_FORCE: std::ops::RangeInclusive<f64> = 5.0..=10.0;
/// Reward lost for each newton beyond the allowed force.
const FORCE_PRICE: f64 = 0.2;
/// A peg is inserted or engaged with its end within this distance of the hole's axis (m).
const CENTRED: f64 = 0.0025;
/// A centred peg is inserted with its end less than this share of the hole's depth above the base.
const IN: f64 = 0.04;
/// A centred peg is engaged with its end less than this share of the hole's depth above the base.
const ENGAGED: f64 = 0.9;
/// A torque about the peg's end that a learner sees as 1 (Nm). 5 N at half of the peg's width are 0.02 Nm, which the
/// learner should notice.
const MUCH_TORQUE: f64 = 0.05;
/// Positions of four points on the peg's axis, from its end (m, positive towards the hand).
const KEYPOINTS: [f64; 4] = [-0.075, -0.025, 0.025, 0.075];
/// Slope (1/m) and offset of the reward's three terms for the keypoints' mean distance from their places in an inserted peg.
const SLOPES: [(f64, f64); 3] = [(5.0, 4.0), (50.0, 2.0), (100.0, 0.0)];
/// Draws of an episode after which a reset panics, if the arm reaches the drawn place in none.
const MOST_DRAWS: u32 = 1000;

/// The task, with what was drawn for the running episode.
pub struct Insert {
    options: Options,
    episode: Option<Running>,
}

struct Running {
    /// Middle of the rim (m, world).
    rim: Vector3,
    /// Where the policy believes the middle of the rim to be (m, world).
    believed: Vector3,
    /// Where the arm starts.
    q: JointVector,
    /// The force above which the reward takes off [`FORCE_PRICE`] per newton (N).
    allowed_force: f64,
    script: Script,
}

/// Mean distance (m) of the four keypoints on the peg's axis from their places in an inserted peg. `end` is the pose of
/// the peg's end, z out of the peg; `base` is the middle of the hole's base (m, world).
fn distance(end: &Pose, base: &Vector3) -> f64 {
    let apart = |along: f64| {
        let point = end * Translation3::new(0.0, 0.0, -along);
        (point.translation.vector - base - Vector3::z() * along).norm()
    };
    KEYPOINTS.map(apart).iter().sum::<f64>() / 4.0
}

/// Reward for a distance d (m): 1 / (exp(a d) + b + exp(-a d)), a being the slope (1/m) and b the offset.
fn squashed(distance: f64, (slope, offset): (f64, f64)) -> f64 {
    let growth = libm::exp(slope * distance);
    1.0 / (growth + offset + 1.0 / growth)
}

impl Insert {
    fn new(config: &EnvConfig) -> Result<Self, ConfigError> {
        let task = Insert { options: Options::of(config)?, episode: None };
        let robot = config.robot.robot();
        let sizes = task.options.sizes();
        let (scene, gripper) = insert::scene(&robot, &sizes, [0.0; 2]);
        let model = Model::new(&scene, gripper, GRIP_SITE);
        let Options { length_mm, start_mm, .. } = task.options;
        // The sixteen extremes of the places and turns that an episode draws.
        for corner in 0..16 {
            let side = |axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
            let furthest = Vector3::from_fn(|axis, _| side(axis) * ([PLACEMENT, PLACEMENT, 0.0][axis] + START[axis]));
            let place = Vector3::z() * (TABLE_HEIGHT + DEPTH) + furthest;
            if task.posture(&model, &robot, place, side(3) * START_TURN).is_none() {
                return Err(ConfigError::Contradiction {
                    field: "env.options".into(),
                    reason: format!(
                        "{} does not reach all places above the hole: length_mm = {length_mm}, start_mm = {start_mm}; lower start_mm, or \
                         move the arm (env.robot.mount)",
                        robot.name
                    ),
                });
            }
        }
        Ok(task)
    }

    /// Joint angles (rad) at which the peg's end stands `start_mm` above `place` (m, world), the hand straight down and
    /// turned about z by `turn` (rad) against its home pose. `None` if the arm does not reach that pose.
    fn posture(&self, model: &Model, robot: &Robot, place: Vector3, turn: f64) -> Option<JointVector> {
        let home = model.kinematics(&robot.home).tool;
        let rotation =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn) * straight_down(&(home * Vector3::x()));
        let height = 1e-3 * self.options.start_mm + self.options.sizes().end();
        let goal = Pose::from_parts(Translation3::from(place + Vector3::z() * height), rotation);
        robot.reach(model, &goal, robot.home)
    }

    fn running(&self) -> &Running {
        self.episode.as_ref().expect("reset before use")
    }

    /// Pose of the peg's end (world) in a hand whose tool point is at `tool`: z points out of the peg.
    fn end(&self, tool: &Pose) -> Pose {
        tool * at([0.0, 0.0, self.options.sizes().end()])
    }

    /// Middle of the hole's base (m, world).
    fn base(&self) -> Vector3 {
        self.running().rim - Vector3::z() * DEPTH
    }

    /// Height of the peg's end above the base (m); `None` if the end is not within [`CENTRED`] of the hole's axis.
    fn height(&self, end: &Pose) -> Option<f64> {
        let apart = end.translation.vector - self.base();
        (apart.xy().norm() < CENTRED).then_some(apart.z)
    }

    fn seen(&self, y: &Measurement) -> Seen {
        let end = self.end(&y.pose);
        let hand = y.pose.rotation;
        let upright = match self.options.profile {
            Profile::Round => straight_down(&(hand * Vector3::x())),
            Profile::Square => nearest_straight_down(&Vector3::x(), 4, &hand),
        };
        // The script does not know the hole's true place, only whether the peg is in.
        let done = self.height(&end).is_some_and(|height| height < IN * DEPTH);
        Seen { end: end.translation.vector, rim: self.running().believed, upright, done }
    }
}

impl Task for Insert {
    fn reset(&mut self, plant: &Plant, rng: &mut ChaCha8Rng) -> Simulation {
        let sizes = self.options.sizes();
        for _ in 0..MOST_DRAWS {
            let mut within = |half: f64| rng.random_range(-half..=half);
            let rim = Vector3::new(within(PLACEMENT), within(PLACEMENT), TABLE_HEIGHT + DEPTH);
            let place = rim + Vector3::from(START.map(&mut within));
            let turn = within(START_TURN);
            let believed = rim + BELIEF * Vector3::from_fn(|_, _| standard_normal(rng));
            let allowed_force = rng.random_range(ALLOWED_FORCE);
            let simulation = insert::simulate(plant, &sizes, rim.xy().into());
            if let Some(q) = self.posture(simulation.model(), &plant.robot, place, turn) {
                self.episode = Some(Running { rim, believed, q, allowed_force, script: Script::default() });
                return simulation;
            }
        }
        panic!("{MOST_DRAWS} places above the hole in insert are out of reach for {}", plant.robot.name);
    }

    fn start(&self, _: &Robot) -> Start {
        Start { fingers: Fingers::Apart(WIDTH), ..Start::at(self.running().q) }
    }

    fn name(&self) -> &'static str {
        TaskName::INSERT.as_str()
    }

    /// The fingers stay where they are.
    fn has_gripper(&self) -> bool {
        false
    }

    /// Torque about the peg's end, which shows on which side the rim presses. About the tool point the moment of the friction at the end
    /// would hide that.
    fn feel(&self) -> Feel {
        Feel { about: Vector3::z() * self.options.sizes().end(), torque: MUCH_TORQUE, in_world: true }
    }

    fn observe(&self, _: &Simulation, y: &Measurement, out: &mut Observer) {
        let Running { believed, allowed_force, .. } = self.running();
        out.position("hole_to_eef_pos", y.pose.translation.vector - believed, [0.0, 0.0, 0.03], 200.0);
        out.axes("eef_vel", &y.twist, ["m/s, world", "rad/s, world"], [0.0; 2], [10.0, 2.0]);
        out.put("allowed_force", *allowed_force, "N", 7.5, 0.4);
    }

    /// The true places of hole and peg.
    fn observe_privileged(&self, simulation: &Simulation, _: &Measurement, out: &mut Observer) {
        let Running { rim, believed, .. } = self.running();
        let end = self.end(&simulation.measure().pose);
        out.position("rim_pos", *rim, [0.0, 0.0, TABLE_HEIGHT + DEPTH], 20.0);
        out.position("believed_error", believed - rim, [0.0; 3], 1000.0);
        out.position("base_to_peg_end_pos", end.translation.vector - self.base(), [0.0; 3], 200.0);
        out.orientation("peg_quat", &end.rotation);
    }

    /// As in FORGE, only the force at the end of the action has a price. With the option `penalty` the other tasks' force
    /// penalty is subtracted too, which prices the largest force of the action.
    fn reward(&mut self, simulation: &Simulation, y: &Measurement, penalty: Option<f64>) -> Reward {
        let end = self.end(&y.pose);
        let distance = distance(&end, &self.base());
        let [coarse, near, fine] = SLOPES.map(|slope| squashed(distance, slope));
        let below = |share: f64| self.height(&end).is_some_and(|height| height < share * DEPTH);
        let (engaged, success) = (below(ENGAGED), below(IN));
        let excess = (simulation.contact().hand_force() - self.running().allowed_force).max(0.0);
        let penalty = penalty.filter(|_| self.options.penalty).unwrap_or(0.0);
        let terms = [
            ("coarse", coarse),
            ("near", near),
            ("fine", fine),
            ("engaged", f64::from(engaged)),
            ("inserted", f64::from(success)),
            ("force", -FORCE_PRICE * excess),
            ("penalty", -penalty),
        ];
        Reward { terms: terms.into(), success }
    }

    /// The script knows what a policy sees: the hole's believed place and the force. It also knows when the peg is in.
    fn expert(&self, _: &Simulation, y: &Measurement) -> Waypoint {
        self.running().script.waypoint(&self.seen(y), y)
    }

    fn advance(&mut self, _: &Simulation, y: &Measurement) {
        let seen = self.seen(y);
        self.episode.as_mut().expect("reset before use").script.advance(&seen, y);
    }

    fn achievement(&self) -> &'static str {
        "puts the peg into the hole"
    }

    fn camera(&self) -> Camera {
        Camera { eye: [0.3, -0.36, 1.02], target: [0.0, 0.0, 0.87], field_of_view: 0.6 }
    }
}

#[cfg(test)]
mod tests;
