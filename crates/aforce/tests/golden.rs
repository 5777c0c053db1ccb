//! The torques of every built-in space, to the last bit: `golden/README.md` describes the files. A change of the law fails here;
//! `GOLDEN=write cargo test -p aforce --test golden` records the new torques.

use std::collections::HashMap;
use std::fmt::Write;
use std::path::PathBuf;

use aforce::{
    ActionSpace, Arm, Controller, ControllerConfig, Jacobian, JointMatrix, JointVector, Measurement, Pose, Twist,
    Vector3, Wrench,
};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

/// Largest torques (Nm).
const LIMITS: [f64; 7] = [80.0, 80.0, 80.0, 80.0, 80.0, 12.0, 12.0];

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

/// The lines of a file, without its header.
fn lines(name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(path(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    text.lines().skip(1).map(str::to_owned).collect()
}

fn numbers(cells: &str) -> Vec<f64> {
    cells.split(',').map(|cell| cell.parse().unwrap_or_else(|_| panic!("{cell:?} is no number"))).collect()
}

fn measurements() -> Vec<Measurement> {
    let measurement = |line: &String| {
        let row = numbers(line);
        let mut at = 1; // Column 0 is the sample's number.
        let mut take = |count: usize| {
            at += count;
            &row[at - count..at]
        };
        let [q, qd] = [0; 2].map(|_| JointVector::from_column_slice(take(7)));
        let position = Translation3::from(Vector3::from_column_slice(take(3)));
        // Not normalised: the numbers count as they stand in the file.
        let rotation =
            UnitQuaternion::new_unchecked(Quaternion::from_vector(nalgebra::Vector4::from_column_slice(take(4))));
        let measurement = Measurement {
            q,
            qd,
            pose: Pose::from_parts(position, rotation),
            twist: Twist::from_column_slice(take(6)),
            jacobian: Jacobian::from_row_slice(take(42)),
            mass: JointMatrix::from_row_slice(take(49)),
            bias: JointVector::from_column_slice(take(7)),
            wrench: Wrench::from_column_slice(take(6)),
        };
        assert_eq!(at, row.len());
        measurement
    };
    lines("measurements.csv").iter().map(measurement).collect()
}

/// Actions by the sample before which they come; a space takes as many entries as it has.
fn actions() -> HashMap<usize, Vec<f64>> {
    let action = |line: &String| {
        let (sample, entries) = line.split_once(',').expect("two cells or more");
        (sample.parse().expect("a sample"), numbers(entries))
    };
    lines("actions.csv").iter().map(action).collect()
}

/// The content of `torques.csv` that the present code gives.
fn torques() -> String {
    let (measurements, actions) = (measurements(), actions());
    let arm = Arm { torque_max: LIMITS, torque_rate_max: [f64::INFINITY; 7], ..Arm::PANDA };
    let axes = |name: &str| ["x", "y", "z", "rx", "ry", "rz"].map(|axis| format!("{name}_{axis}")).join(",");
    let joints: Vec<String> = (1..=7).map(|i| format!("tau_{i}")).collect();
    let mut text =
        format!("space,sample,{},{},{},", joints.join(","), axes("k"), axes("f_ff")) + "f_d,f_cmd,engagement\n";
    for space in ActionSpace::built_in() {
        let config = ControllerConfig::default();
        let mut controller = Controller::new(&space, &config, &arm, Vector3::z_axis()).unwrap();
        controller.reset(&measurements[0]);
        for (sample, y) in measurements.iter().enumerate() {
            if let Some(action) = actions.get(&sample) {
                controller.set_goal(&action[..space.dim()], y);
            }
            let tau = controller.update(y);
            let force = [controller.desired_force(), controller.force_command(), controller.engagement()];
            write!(text, "{space},{sample}").unwrap();
            for v in tau.iter().chain(controller.own_stiffness()).chain(controller.feedforward()).chain(&force) {
                write!(text, ",{v:?}").unwrap();
            }
            text.push('\n');
        }
    }
    text
}

#[test]
fn torques_are_those_on_record() {
    let now = torques();
    if std::env::var_os("GOLDEN").is_some_and(|what| what == "write") {
        std::fs::write(path("torques.csv"), &now).unwrap();
    }
    let now: Vec<&str> = now.lines().skip(1).collect();
    let then = lines("torques.csv");
    assert_eq!(now.len(), then.len(), "rows");
    for (now, then) in now.iter().zip(&then) {
        // Numbers are the shortest decimals that read back as the same bits, so equal text means equal bits.
        assert_eq!(now, then);
    }
}

/// The record covers contact, limits and adaptation.
#[test]
fn contact_limits_and_adaptation_are_in_the_record() {
    let torques = torques();
    let rows: Vec<(&str, Vec<f64>)> = torques
        .lines()
        .skip(1)
        .map(|line| line.split_once(',').unwrap())
        .map(|(space, rest)| (space, numbers(rest)))
        .collect();
    let column =
        |space: &str, at: usize| rows.iter().filter(|row| row.0 == space).map(|row| row.1[at]).collect::<Vec<_>>();
    assert_eq!(rows.len(), ActionSpace::built_in().len() * measurements().len());
    let engagement = column("aforce-force", 22);
    let most = engagement.iter().copied().fold(0.0, f64::max);
    assert!(engagement[0] == 0.0 && most > 0.5 && engagement[39] < most, "contact begins and ends");
    assert!(column("aforce", 8).windows(2).any(|k| k[0] != k[1]), "K moves");
    // In `aforce` no error of the record exceeds the tolerance, and K relaxes.
    assert!(column("aforce-shaped", 8).windows(2).any(|k| k[1] > k[0]), "K grows");
    assert!(column("aforce", 14).iter().any(|&f_ff| f_ff != 0.0));
    let wrist = rows.iter().filter(|row| row.1[6..=7].iter().any(|tau| tau.abs() == 12.0)).count();
    assert!(wrist > 0 && wrist < rows.len(), "a limit is met now and then: {wrist}");
}
