//! How long a host's cycle takes: a million cycles at 1 kHz's settings, every fiftieth with an action whose jerk-limited move is
//! planned in it. Prints a table of percentiles, then a histogram, as CSV:
//!
//! ```text
//! cargo run --release -p aforce --example cycle_times > results/cycle_times.csv
//! ```
//!
//! One cycle follows the other, so caches are warm; a quiet core (`taskset -c 3`, nothing else on it) makes it repeatable.

use std::time::Instant;

use aforce::host::{ArmInterface, ArmState, Host, HostLimits, HostSetup, Status};
use aforce::{Arm, ControllerConfig, Interpolation, Jacobian, JointMatrix, JointVector, Pose, Vector3, Wrench};

const CYCLES: usize = 1_000_000;
/// Cycles per action.
const ACTION: usize = 50;
/// Bins of the histogram per decade.
const BINS: f64 = 10.0;

/// A fixed arm of full rank, in contact; its tool sways so that nothing is constant.
fn state(cycle: usize) -> ArmState {
    let jacobian = Jacobian::from_fn(|i, j| if i == j { 1.0 } else { 0.1 * (i as f64 - 0.7 * j as f64).sin() });
    let root = JointMatrix::from_fn(|i, j| 0.2 * (i as f64 + 2.0 * j as f64).cos());
    let sway = 0.01 * (cycle as f64 * 1e-3).sin();
    ArmState {
        q: JointVector::from([0.0, 0.2, 0.0, -2.0, 0.0, 2.2, 0.8]),
        qd: JointVector::repeat(sway),
        pose: Pose::new(Vector3::new(0.5 + sway, 0.0, 0.3), Vector3::new(3.1, 0.1, sway)),
        jacobian,
        mass: root * root.transpose() + JointMatrix::identity(),
        gravity: JointVector::zeros(),
        coriolis: JointVector::repeat(0.1),
        wrench: Wrench::new(0.0, 0.0, -10.0, 0.0, 0.0, 0.0),
        tau: JointVector::zeros(),
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let setup = HostSetup {
        contact_axis: [0.0, 0.0, 1.0],
        arm: Arm::FR3,
        interface: ArmInterface::FRANKA,
        limits: HostLimits::default(),
        controller: ControllerConfig {
            control_hz: 1000,
            position_step: 0.02,
            rotation_step: 0.15,
            interpolation: Interpolation::JerkLimited { dynamics: 0.15 },
            ..ControllerConfig::default()
        },
        space: "aforce-force".parse()?,
    };
    let mut host = Host::new(&setup)?;
    let first = state(0);
    host.start(&first, &first.pose)?;
    let (mut with_action, mut without) = (Vec::with_capacity(CYCLES / ACTION), Vec::with_capacity(CYCLES));
    for cycle in 0..CYCLES {
        let state = state(cycle);
        let action = std::array::from_fn::<f64, 7, _>(|entry| (cycle as f64 * 0.7 + entry as f64).sin());
        let begin = Instant::now();
        let plans = cycle.is_multiple_of(ACTION);
        if plans {
            host.set_goal(&action)?;
        }
        let command = std::hint::black_box(host.update(&state, 0.001));
        let took = begin.elapsed().as_secs_f64() * 1e6;
        if let Status::Fault(fault) = command.status {
            return Err(fault.into());
        }
        if plans { with_action.push(took) } else { without.push(took) }
    }
    let mut all = [with_action.as_slice(), without.as_slice()].concat();
    println!("# {}", machine());
    println!("cycles,number,p50_us,p99_us,p99.9_us,max_us");
    for (name, times) in [("all", &mut all), ("with an action", &mut with_action), ("without", &mut without)] {
        times.sort_by(f64::total_cmp);
        let at = |share: f64| times[((times.len() - 1) as f64 * share).round() as usize];
        let [p50, p99, p999] = [0.5, 0.99, 0.999].map(at);
        println!("{name},{},{p50:.2},{p99:.2},{p999:.2},{:.2}", times.len(), at(1.0));
    }
    println!("from_us,to_us,cycles");
    let bin = |time: f64| (time.log10() * BINS).floor() as i32;
    for at in bin(all[0])..=bin(all[all.len() - 1]) {
        let count = all.iter().filter(|&&time| bin(time) == at).count();
        let edge = |at: i32| 10f64.powf(f64::from(at) / BINS);
        println!("{:.3},{:.3},{count}", edge(at), edge(at + 1));
    }
    Ok(())
}

/// Processor and kernel, as Linux tells them.
fn machine() -> String {
    let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    let cpu = read("/proc/cpuinfo");
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or("unknown processor");
    format!("{}, Linux {}", model.trim_start_matches([' ', '\t', ':']), read("/proc/sys/kernel/osrelease").trim())
}
