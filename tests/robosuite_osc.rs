//! With a set-point that jumps to its goal, `osc` and `variable` are robosuite's OSC_POSE, fixed and `variable_kp`: torques in
//! random states agree with its formulas, evaluated in numpy (`scripts/osc_reference.py`).

use aforce::{ActionSpace, Arm, Controller, ControllerConfig, Interpolation, Vector3, Wrench};
use nalgebra::SVector;
use physics::robots::RobotName;
use physics::scenes::lift::Lift;
use physics::{Deviation, Plant, SimulationConfig};

fn cells<const N: usize>(numbers: &mut impl Iterator<Item = f64>) -> SVector<f64, N> {
    SVector::from_fn(|_, _| numbers.next().unwrap())
}

#[test]
fn torques_are_robosuites() {
    let robot = RobotName::Robosuite.robot();
    // The formulas are compared before the limits.
    let arm = Arm { torque_max: [1e9; 7], ..robot.arm };
    let plant = Plant { robot, dt: 0.002, config: SimulationConfig::default(), deviation: Deviation::default() };
    let (simulation, _) = Lift::simulate(&plant, Vector3::repeat(0.021));
    let measure = |q, qd| simulation.model().measure(q, qd, Wrench::zeros());
    let config = ControllerConfig {
        position_step: 0.05,
        rotation_step: 0.5,
        // The set-point is the goal from the first sample on.
        interpolation: Interpolation::Linear { ramp_ratio: 0.04 },
        ..ControllerConfig::default()
    };

    let mut rows = 0;
    for line in include_str!("reference/osc.csv").lines().skip(2) {
        let (space, numbers) = line.split_once(',').unwrap();
        let mut numbers = numbers.split(',').map(|cell| cell.parse().unwrap());
        let (q, qd, q0) = (cells::<7>(&mut numbers), cells::<7>(&mut numbers), cells::<7>(&mut numbers));
        let (kp, delta, expected) = (cells::<6>(&mut numbers), cells::<6>(&mut numbers), cells::<7>(&mut numbers));

        let space: ActionSpace = space.parse().unwrap();
        let mut controller = Controller::new(&space, &config, &arm, Vector3::z_axis()).unwrap();
        controller.reset(&measure(q0, SVector::zeros()));
        let y = measure(q, qd);
        let mut action: Vec<f64> =
            if space.dim() == 12 { kp.map(|kp| kp / 150.0 - 1.0).as_slice().into() } else { vec![] };
        action.extend(&delta);
        controller.set_goal(&action, &y);
        let tau = controller.update(&y);

        let error = (tau - expected).amax() / expected.amax();
        assert!(error < 1e-7, "{line}\nis off by {error} of the largest torque");
        rows += 1;
    }
    assert_eq!(rows, 98);
}
