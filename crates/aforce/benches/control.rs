//! One control sample of each action space, and the law alone. Run with `cargo bench -p aforce`.

use std::hint::black_box;

use aforce::{
    ActionSpace, Adapted, AdaptiveLaw, Arm, Controller, ControllerConfig, Errors, ForceConfig, ForceControl,
    Interpolation, Jacobian, JointMatrix, JointVector, Measurement, OperationalSpace, Pose, Twist, Vector3, Vector6,
    Wrench, impedance, pose_error,
};
use criterion::{Criterion, criterion_group, criterion_main};

/// A fixed arm of full rank.
fn measurement() -> Measurement {
    let jacobian = Jacobian::from_fn(|i, j| if i == j { 1.0 } else { 0.1 * (i as f64 - 0.7 * j as f64).sin() });
    let root = JointMatrix::from_fn(|i, j| 0.2 * (i as f64 + 2.0 * j as f64).cos());
    Measurement {
        q: JointVector::repeat(0.3),
        qd: JointVector::repeat(0.01),
        pose: Pose::new(Vector3::new(0.5, 0.0, 0.3), Vector3::new(3.1, 0.1, 0.0)),
        twist: Twist::repeat(0.01),
        jacobian,
        mass: root * root.transpose() + JointMatrix::identity(),
        bias: JointVector::repeat(1.0),
        wrench: Wrench::new(0.0, 0.0, 10.0, 0.0, 0.0, 0.0),
    }
}

fn controller(name: &str, interpolation: Interpolation, y: &Measurement) -> Controller {
    let config = ControllerConfig { interpolation, ..ControllerConfig::default() };
    let arm = Arm { torque_max: [80.0; 7], torque_rate_max: [f64::INFINITY; 7], ..Arm::PANDA };
    let mut control = Controller::new(&name.parse().unwrap(), &config, &arm, Vector3::z_axis()).unwrap();
    control.reset(y);
    control
}

fn control(c: &mut Criterion) {
    let y = measurement();
    let linear = Interpolation::Linear { ramp_ratio: 1.0 };
    for name in ["aforce", "aforce-force", "aforce-shaped", "aforce-psi", "variable", "osc", "low", "robosuite-osc"] {
        let mut control = controller(name, linear, &y);
        c.bench_function(&format!("update/{name}"), |b| b.iter(|| control.update(black_box(&y))));
    }
    for (kind, interpolation) in [("linear", linear), ("jerk-limited", Interpolation::JerkLimited { dynamics: 1.0 })] {
        let mut control = controller("aforce", interpolation, &y);
        c.bench_function(&format!("one action: set_goal and 25 updates/{kind}"), |b| {
            let mut sign = 0.5;
            b.iter(|| {
                sign = -sign;
                control.set_goal(&[sign; 6], &y);
                for _ in 0..25 {
                    black_box(control.update(black_box(&y)));
                }
            });
        });
    }
    let lambda = OperationalSpace::new(&y.mass, &y.jacobian).unwrap();
    c.bench_function("operational space", |b| b.iter(|| OperationalSpace::new(black_box(&y.mass), &y.jacobian)));

    // The adaptive law without the arm's dynamics: error, K and F_ff, force, wrench.
    let aforce: ActionSpace = "aforce-force".parse().unwrap();
    let mut law = AdaptiveLaw::new(*aforce.psi().unwrap());
    let mut force = ForceControl::new(ForceConfig::default(), Vector3::z());
    let x_d = Pose::new(Vector3::new(0.49, 0.01, 0.3), Vector3::new(3.0, 0.1, 0.1));
    let (none, axis) = (Vector6::zeros(), force.axis());
    let mut errors = Errors { e: none, e_dot: y.twist, excess: none, axis, lambda, dt: 0.002 };
    c.bench_function("law alone", |b| {
        b.iter(|| {
            errors.e = pose_error(black_box(&y.pose), &x_d);
            law.update(&errors.e, &errors.e_dot, &errors.excess, errors.dt);
            let force_command = force.update(&y.wrench, errors.dt);
            errors.axis = force.axis();
            let adapted =
                Adapted { stiffness: *law.stiffness(), feedforward: *law.feedforward(), force: force_command };
            let parts = impedance(&aforce, &errors, &adapted);
            -parts.elastic - parts.viscous - adapted.force
        });
    });
}

criterion_group!(benches, control);
criterion_main!(benches);
