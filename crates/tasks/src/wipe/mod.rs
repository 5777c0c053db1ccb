//! Wipe: clean a line of markers off a table (robosuite 1.4 `Wipe`, with the paper's
//! condition on the force).

mod marker_view;
mod markers;

use aforce::{Measurement, Pose, Vector3};
use nalgebra::Translation3;
use physics::camera::{Camera, Decal};
use physics::robots::{JOINTS, Robot};
use physics::scenes::wipe::{self, TABLE_FRICTION, TABLE_HEIGHT};
use physics::wiping_tool::facing_down;
use physics::{Plant, Simulation};
use rand_chacha::ChaCha8Rng;

use crate::normalisation::{COMPLETION_REWARD, CONTACT_REWARD, MARKER_REWARD, MARKERS, normalisation};
use crate::observation::in_contact;
use crate::observation_options::MarkerView;
use crate::observer::Observer;
use crate::spot::Spot;
use crate::start::Start;
use crate::task::{Reward, Task, Waypoint};
use crate::task_kind::TaskKind;
use crate::task_name::TaskName;

pub use markers::Markers;

/// What Wipe is registered with. Its option is `env.observation.markers` and not below `env.options`, because the settings of earlier runs
/// have it there.
pub(crate) const KIND: TaskKind =
    TaskKind::new(TaskName::WIPE.as_str(), "wipe a line of markers off a table", |config| {
        Ok(Box::new(Wipe::new(config.horizon, config.observation.markers)))
    })
    .disturbed_by(&["table_height_m"]);

/// A marker is wiped while the tool presses with more than the first and at most the
/// second (N).
const WIPING_FORCE: [f64; 2] = [15.0, 60.0];
/// Pressing is rewarded above this force (N).
const PRESSING_FORCE: f64 = 0.5;
/// A joint nearer than this to an end of its range counts as at its limit (rad).
const JOINT_MARGIN: f64 = 0.1;

// robosuite's rewards, before normalisation.
const ARM_PENALTY: f64 = -10.0;
/// Per newton pressed.
const FORCE_REWARD: f64 = 0.01;
/// While the whole face is in contact: in robosuite, more than 50 of its 70 contact points.
const FLAT_REWARD: f64 = 0.1;
const DISTANCE_REWARD: f64 = 5.0;
/// 1/m.
const DISTANCE_SLOPE: f64 = 5.0;

/// Force with which the script presses (N).
const EXPERT_FORCE: f64 = 28.0;

/// The task, with scene and markers of the running episode.
pub struct Wipe {
    /// Factor on every reward.
    scale: f64,
    /// How the markers are seen.
    view: MarkerView,
    /// The spot of paint that lies in place of the line.
    spot: Option<Spot>,
    episode: Option<Running>,
}

/// The running episode.
struct Running {
    scene: wipe::Wipe,
    markers: Markers,
    /// How much higher the table stands than is believed (m).
    raised: f64,
    /// Lower and upper end of the robot's joints (rad).
    range: [[f64; 2]; JOINTS],
}

/// What the reward depends on besides the markers.
struct Touch {
    /// The arm touches something, or a joint is at the end of its range.
    arm: bool,
    /// The tool touches something, and the force on it without measurement noise is above 1 N.
    contact: bool,
    /// Sustained force on the tool (N).
    force: f64,
    /// A marker is wiped under more than the first and at most the second (N).
    wiping_force: [f64; 2],
    /// The whole face is in contact.
    flat: bool,
    /// Force penalty of the action, if it pressed too hard.
    penalty: Option<f64>,
}

impl Wipe {
    /// For episodes of `horizon` actions, the markers seen as `view` says.
    pub fn new(horizon: u32, view: MarkerView) -> Self {
        Wipe { scale: normalisation(horizon), view, spot: None, episode: None }
    }

    /// As [`Wipe::new`], with a spot of paint in place of the line.
    pub fn spot(horizon: u32, view: MarkerView, spot: Spot) -> Self {
        Wipe { spot: Some(spot), ..Wipe::new(horizon, view) }
    }

    /// Height of the table top (m) as it is believed to be, and its sliding friction.
    fn table(&self) -> (f64, f64) {
        self.spot.map_or((TABLE_HEIGHT, TABLE_FRICTION), |spot| (spot.height, spot.friction))
    }

    /// Lower and upper end of the force that wipes (N).
    fn wiping_force(&self) -> [f64; 2] {
        self.spot.map_or(WIPING_FORCE, |spot| spot.wiping_force)
    }

    fn running(&self) -> &Running {
        self.episode.as_ref().expect("reset before use")
    }
}

/// Terms of the reward before normalisation.
fn reward_terms(markers: &mut Markers, tool: &Pose, touch: &Touch) -> [(&'static str, f64); 4] {
    let named =
        |reach, wiped, press, penalty| [("reach", reach), ("wiped", wiped), ("press", press), ("penalty", penalty)];
    if touch.arm {
        return named(0.0, 0.0, 0.0, ARM_PENALTY);
    }
    let [low, high] = touch.wiping_force;
    let wipes = touch.contact && touch.force > low && touch.force <= high;
    let wiped = if wipes { MARKER_REWARD * markers.wipe(tool) as f64 } else { 0.0 };
    let (reach, complete) = match markers.centroid_and_radius() {
        Some((centroid, _)) => {
            let distance = (centroid - tool.translation.vector).norm();
            (DISTANCE_REWARD * (1.0 - libm::tanh(DISTANCE_SLOPE * distance)), 0.0)
        }
        None => (0.0, COMPLETION_REWARD),
    };
    let mut press = if touch.contact { CONTACT_REWARD } else { 0.0 };
    if touch.penalty.is_none() && touch.contact && touch.force > PRESSING_FORCE {
        press += CONTACT_REWARD + FORCE_REWARD * touch.force + if touch.flat { FLAT_REWARD } else { 0.0 };
    }
    named(reach, wiped + complete, press, -touch.penalty.unwrap_or(0.0))
}

impl Task for Wipe {
    fn reset(&mut self, plant: &Plant, rng: &mut ChaCha8Rng) -> Simulation {
        let (height, friction) = self.table();
        let (simulation, scene) = wipe::Wipe::simulate(plant, height, friction);
        let raised = plant.deviation.table_height;
        let markers = match self.spot {
            None => Markers::random(height + raised, rng),
            Some(Spot { centre: [x, y], radius, .. }) => Markers::spot(Vector3::new(x, y, height + raised), radius),
        };
        self.episode = Some(Running { scene, markers, raised, range: plant.robot.arm.range });
        simulation
    }

    fn start(&self, robot: &Robot) -> Start {
        Start::at(self.spot.map_or(robot.home, |spot| spot.start))
    }

    fn name(&self) -> &'static str {
        TaskName::WIPE.as_str()
    }

    fn has_gripper(&self) -> bool {
        false
    }

    fn observe(&self, _: &Simulation, y: &Measurement, out: &mut Observer) {
        let Running { markers, raised, .. } = self.running();
        self.view.observe(markers, *raised, &y.pose.translation.vector, out);
    }

    /// Height of the tool above the true table, whether the tool lies flat on it, and the wiped share.
    fn observe_privileged(&self, simulation: &Simulation, _: &Measurement, out: &mut Observer) {
        let Running { scene, markers, raised, .. } = self.running();
        // Without the noise of the policy's measurement.
        let height = simulation.measure().pose.translation.z - self.table().0 - raised;
        out.put("height_above_table", height, "m", 0.0, 20.0);
        out.put("tool_flat", f64::from(scene.is_flat(simulation)), "0 or 1", 0.0, 1.0);
        out.put("wiped_share", markers.wiped_share(), "1", 0.5, 2.0);
    }

    fn reward(&mut self, simulation: &Simulation, y: &Measurement, penalty: Option<f64>) -> Reward {
        let at_limit = |(&q, &[low, high]): (&f64, &[f64; 2])| q < low + JOINT_MARGIN || q > high - JOINT_MARGIN;
        let touch = Touch {
            arm: simulation.contact().arm_touches() || y.q.iter().zip(&self.running().range).any(at_limit),
            contact: in_contact(y) && simulation.contact().touching,
            force: simulation.contact().hand_force(),
            wiping_force: self.wiping_force(),
            flat: self.running().scene.is_flat(simulation),
            penalty,
        };
        let markers = &mut self.episode.as_mut().expect("reset before use").markers;
        let terms = reward_terms(markers, &y.pose, &touch).map(|(name, term)| (name, self.scale * term));
        Reward { terms: terms.into(), success: markers.wiped_count() == MARKERS }
    }

    /// Moves the level tool above the nearer end of the remaining line, down, and along the line under pressure; up when no marker remains.
    fn expert(&self, _: &Simulation, y: &Measurement) -> Waypoint {
        let tool = y.pose.translation.vector;
        let distance = |marker: &Vector3| (marker - tool).xy().norm();
        let ends = [self.running().markers.remaining().next(), self.running().markers.remaining().last()]
            .into_iter()
            .flatten();
        let level = facing_down();
        let table = self.table().0;
        let at = |x: f64, y: f64, height: f64| Pose::from_parts(Translation3::new(x, y, table + height), level);
        let Some(target) = ends.min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
            return Waypoint { pose: at(tool.x, tool.y, 0.05), grip: 0.0, force: 0.0 };
        };
        let down = in_contact(y) || (distance(&target) < 0.02 && tool.z < table + 0.025);
        let press = down && y.pose.rotation.angle_to(&level) < 0.15;
        Waypoint { pose: at(target.x, target.y, 0.015), grip: 0.0, force: if press { EXPERT_FORCE } else { 0.0 } }
    }

    fn progress(&self) -> Option<f64> {
        Some(self.running().markers.wiped_share())
    }

    fn achievement(&self) -> &'static str {
        "wipes every marker"
    }

    fn camera(&self) -> Camera {
        Camera { eye: [0.8, -0.7, 1.45], target: [-0.02, 0.0, 0.98], field_of_view: 0.76 }
    }

    fn decals(&self) -> Vec<Decal> {
        let decal = |(marker, wiped): (Vector3, bool)| Decal {
            centre: marker.into(),
            radius: markers::RADIUS,
            color: if wiped { [168, 200, 150] } else { [120, 60, 40] },
        };
        let (clean, dirty): (Vec<_>, Vec<_>) = self.running().markers.iter().partition(|(_, wiped)| *wiped);
        clean.into_iter().chain(dirty).map(decal).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    const AIR: Touch =
        Touch { arm: false, contact: false, force: 0.0, wiping_force: WIPING_FORCE, flat: false, penalty: None };
    const PRESSING: Touch = Touch { contact: true, force: 30.0, flat: true, ..AIR };

    fn markers() -> Markers {
        Markers::random(0.0, &mut ChaCha8Rng::seed_from_u64(1))
    }

    fn reward(markers: &mut Markers, tool: &Pose, touch: &Touch) -> f64 {
        reward_terms(markers, tool, touch).into_iter().map(|(_, term)| term).sum()
    }

    /// A level tool `height` (m) above the middle of the remaining markers.
    fn over(markers: &Markers, height: f64) -> Pose {
        let centroid = markers.centroid_and_radius().expect("markers remain").0;
        Pose::from_parts(Translation3::from(centroid + height * Vector3::z()), facing_down())
    }

    /// Wipes all markers in turn; returns the last pose.
    fn wipe_all(markers: &mut Markers) -> Pose {
        let mut pose = Pose::identity();
        let line: Vec<Vector3> = markers.remaining().collect();
        for marker in line {
            pose = Pose::from_parts(Translation3::from(marker), facing_down());
            reward(markers, &pose, &PRESSING);
        }
        pose
    }

    #[test]
    fn in_the_air_nearness_counts() {
        let mut markers = markers();
        let tool = over(&markers, 0.1);
        // 5 (1 - tanh 0.5)
        assert!((reward(&mut markers, &tool, &AIR) - 2.689414).abs() < 1e-6);
        assert_eq!(reward(&mut markers, &tool, &Touch { arm: true, ..PRESSING }), -10.0);
        assert_eq!(markers.wiped_count(), 0);
    }

    #[test]
    fn markers_are_wiped_between_15_and_60_newtons() {
        for (force, wipes) in [(15.0, false), (15.1, true), (60.0, true), (60.1, false)] {
            let mut markers = markers();
            let tool = Pose::from_parts(Translation3::from(markers.remaining().next().unwrap()), facing_down());
            reward(&mut markers, &tool, &Touch { force, ..PRESSING });
            assert_eq!(markers.wiped_count() > 0, wipes, "{force} N");
        }
        let mut markers = markers();
        let tool = over(&markers, 0.0);
        reward(&mut markers, &tool, &Touch { contact: false, ..PRESSING });
        assert_eq!(markers.wiped_count(), 0, "without contact");
    }

    #[test]
    fn each_marker_earns_50_once() {
        let mut markers = markers();
        let tool = Pose::from_parts(Translation3::from(markers.remaining().next().unwrap()), facing_down());
        let first = reward(&mut markers, &tool, &PRESSING);
        let second = reward(&mut markers, &tool, &PRESSING);
        assert!((first - second - 50.0 * markers.wiped_count() as f64).abs() < 1e-9);
    }

    #[test]
    fn completion_pressing_and_penalty_add_up() {
        let mut markers = markers();
        let tool = wipe_all(&mut markers);
        let mut reward = |touch: Touch| reward(&mut markers, &tool, &touch);
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        close(reward(AIR), 25.5);
        // Contact 0.01; pressing 0.01 and 0.01 per newton; flat 0.1.
        close(reward(PRESSING), 25.5 + 0.01 + 0.01 + 0.3 + 0.1);
        close(reward(Touch { flat: false, ..PRESSING }), 25.5 + 0.01 + 0.01 + 0.3);
        close(reward(Touch { penalty: Some(4.0), force: 80.0, ..PRESSING }), 25.5 + 0.01 - 4.0);
        // Pressing too hard earns nothing, even where it costs nothing.
        close(reward(Touch { penalty: Some(0.0), force: 80.0, ..PRESSING }), 25.5 + 0.01);
    }
}
