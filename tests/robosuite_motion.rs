//! With robosuite's action spaces to the letter the arm moves as in robosuite 1.4.1: 40 scenarios of 40 actions in free
//! space, recorded by `scripts/robosuite_motion.py`.

use aforce::{ActionSpace, Controller, ControllerConfig, JointVector, Pose, Vector3, pose_error};
use physics::robots::RobotName;
use physics::scenes::lift::Lift;
use physics::scenes::wipe::{TABLE_FRICTION, TABLE_HEIGHT, Wipe};
use physics::{Deviation, Plant, Simulation, SimulationConfig};

/// What robosuite did.
struct Scenario {
    name: String,
    task: String,
    space: ActionSpace,
    start: JointVector,
    /// In [-1, 1], the gripper's last where there is one.
    actions: Vec<Vec<f64>>,
    /// The grip site after every eighth action.
    poses: Vec<Pose>,
}

/// Actions between two recorded poses.
const SAMPLE: usize = 8;

fn scenarios() -> Vec<Scenario> {
    let mut scenarios: Vec<Scenario> = vec![];
    for line in include_str!("reference/robosuite_motion.csv").lines().skip(1) {
        let (what, rest) = line.split_once(',').unwrap();
        let numbers = || rest.split(',').map(|cell| cell.parse().unwrap()).collect::<Vec<f64>>();
        if what == "scenario" {
            let [task, space, kind] = rest.split(',').collect::<Vec<_>>()[..] else { panic!("{line}") };
            scenarios.push(Scenario {
                name: format!("{} {task} {space} {kind}", scenarios.len() + 1),
                task: task.into(),
                space: space.parse().unwrap(),
                start: JointVector::zeros(),
                actions: vec![],
                poses: vec![],
            });
            continue;
        }
        let scenario = scenarios.last_mut().unwrap();
        match (what, numbers()) {
            ("start", q) => scenario.start = JointVector::from_vec(q),
            ("action", action) => scenario.actions.push(action),
            ("state", n) => {
                scenario.poses.push(physics::scene::pose([n[0], n[1], n[2]], [n[3], n[4], n[5], n[6]]));
            }
            _ => panic!("{line}"),
        }
    }
    scenarios
}

fn simulate(task: &str, plant: &Plant) -> Simulation {
    match task {
        "lift" => Lift::simulate(plant, Vector3::repeat(0.021)).0,
        "wipe" => Wipe::simulate(plant, TABLE_HEIGHT, TABLE_FRICTION).0,
        _ => panic!("{task}"),
    }
}

/// Poses after every eighth action, the arm starting at rest at `start`.
fn play(scenario: &Scenario, start: &JointVector) -> Vec<Pose> {
    let config = ControllerConfig { position_step: 0.05, rotation_step: 0.5, ..ControllerConfig::default() };
    let robot = RobotName::Robosuite.robot();
    let arm = robot.arm;
    let plant = Plant { robot, dt: config.dt(), config: SimulationConfig::default(), deviation: Deviation::default() };
    let mut simulation = simulate(&scenario.task, &plant);
    simulation.reset(start);
    let mut controller = Controller::new(&scenario.space, &config, &arm, Vector3::z_axis()).unwrap();
    let mut y = simulation.measure();
    controller.reset(&y);
    let mut poses = vec![];
    for (k, action) in scenario.actions.iter().enumerate() {
        let (motion, grip) = action.split_at(scenario.space.dim());
        controller.set_goal(motion, &y);
        for _ in 0..config.samples_per_action() {
            let tau = controller.update(&y);
            simulation.step(&tau, grip.first().copied().unwrap_or(0.0)).unwrap();
            y = simulation.measure();
            assert!(
                !simulation.contact().touching && !simulation.contact().arm_touches(),
                "{}: touches",
                scenario.name
            );
        }
        if (k + 1) % SAMPLE == 0 {
            poses.push(y.pose);
        }
    }
    poses
}

/// Largest distance (m) and angle (rad) between the poses of two runs.
fn difference(a: &[Pose], b: &[Pose]) -> [f64; 2] {
    assert_eq!(a.len(), b.len());
    let errors = || a.iter().zip(b).map(|(a, b)| pose_error(a, b));
    [0, 3].map(|at| errors().map(|e| e.fixed_rows::<3>(at).norm()).fold(0.0, f64::max))
}

/// None is left out: none is chaotic, a millionth of a radian at the start grows to less than 0.05 mm.
#[test]
fn the_arm_moves_as_robosuites() {
    let scenarios = scenarios();
    assert_eq!(scenarios.len(), 40);
    let mut distances = vec![];
    for scenario in scenarios {
        let ours = play(&scenario, &scenario.start);
        let [distance, angle] = difference(&ours, &scenario.poses);
        let [grown, _] = difference(&ours, &play(&scenario, &scenario.start.add_scalar(1e-6)));
        let name = scenario.name;
        println!("{name}: {:.2} mm, {angle:.4} rad; from 1e-6 rad {:.3} mm", 1e3 * distance, 1e3 * grown);
        assert!(distance < 4e-3 && angle < 0.015 && grown < 5e-5, "{name}: {distance} m, {angle} rad, grown {grown} m");
        distances.push(distance);
    }
    distances.sort_by(f64::total_cmp);
    let median = (distances[19] + distances[20]) / 2.0;
    println!("median {:.3} mm", 1e3 * median);
    assert!(median < 2e-4, "{median} m");
}
