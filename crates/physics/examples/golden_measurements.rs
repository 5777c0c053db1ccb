//! Prints `crates/aforce/tests/golden/measurements.csv`: what the Panda with the wiping tool measures in 40 control samples
//! of a smooth motion, pushed from sample 8 to sample 29.

use aforce::{JointVector, Measurement, Wrench};
use physics::model::Model;
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scenes::wipe;
use physics::wiping_tool::GRIP_SITE;

const SAMPLES: u32 = 40;
const DT: f64 = 0.002;

fn main() {
    let (scene, tool) = wipe::scene(&RobotName::Robosuite.robot(), wipe::TABLE_HEIGHT, wipe::TABLE_FRICTION);
    let model = Model::new(&scene, tool, GRIP_SITE);
    println!("{}", header().join(","));
    for sample in 0..SAMPLES {
        let t = DT * f64::from(sample);
        // Every joint swings at its own rate, up to 0.36 rad/s.
        let rate = JointVector::from_fn(|i, _| 3.0 + i as f64);
        let q = JointVector::from_fn(|i, _| HOME[i] + 0.04 * libm::sin(rate[i] * t + i as f64));
        let qd = JointVector::from_fn(|i, _| 0.04 * rate[i] * libm::cos(rate[i] * t + i as f64));
        println!("{sample},{}", row(&model.measure(q, qd, push(sample))));
    }
}

/// What pushes on the tool: up to 20 N from below with friction and a moment, and in every sample noise of up to 0.05 N
/// or Nm.
fn push(sample: u32) -> Wrench {
    let contact = if (8..30).contains(&sample) { (f64::from(sample - 7) / 4.0).min(1.0) } else { 0.0 };
    let noise = Wrench::from_fn(|i, _| 0.05 * libm::sin((i as f64 + 1.3) * f64::from(sample)));
    contact * Wrench::new(-3.0, 2.0, 20.0, 0.5, -0.3, 0.1) + noise
}

/// Ten decimals: a measurement needs no more, and the file's rounded numbers are the ones that the test reads.
fn row(y: &Measurement) -> String {
    let (jacobian, mass) = (y.jacobian.transpose(), y.mass.transpose()); // Row by row.
    let parts: [&[f64]; 9] = [
        y.q.as_slice(),
        y.qd.as_slice(),
        y.pose.translation.vector.as_slice(),
        y.pose.rotation.coords.as_slice(),
        y.twist.as_slice(),
        jacobian.as_slice(),
        mass.as_slice(),
        y.bias.as_slice(),
        y.wrench.as_slice(),
    ];
    let rounded = |v: &f64| (format!("{v:.10}").parse::<f64>().expect("a number") + 0.0).to_string(); // No -0.
    parts.concat().iter().map(rounded).collect::<Vec<_>>().join(",")
}

fn header() -> Vec<String> {
    let joints = |name: &str| (1..=7).map(|i| format!("{name}_{i}")).collect::<Vec<_>>();
    let matrix = |name: &str, rows: usize| {
        (1..=rows).flat_map(|i| (1..=7).map(move |j| (i, j))).map(|(i, j)| format!("{name}_{i}{j}")).collect::<Vec<_>>()
    };
    let named = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
    [
        named(&["sample"]),
        joints("q"),
        joints("qd"),
        named(&["p_x", "p_y", "p_z", "quat_x", "quat_y", "quat_z", "quat_w"]),
        named(&["v_x", "v_y", "v_z", "w_x", "w_y", "w_z"]),
        matrix("j", 6),
        matrix("m", 7),
        joints("bias"),
        named(&["f_x", "f_y", "f_z", "m_x", "m_y", "m_z"]),
    ]
    .concat()
}
