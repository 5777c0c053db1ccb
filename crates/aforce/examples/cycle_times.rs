//! How long one cycle of a host takes, over a million cycles with the settings for 1 kHz. Every fiftieth cycle takes an
//! action and plans its jerk-limited move. Prints a table of percentiles, then a histogram, as CSV:
//!
//! ```text
//! cargo run --release -p aforce --example cycle_times > results/cycle_times.csv
//! ```
//!
//! Cycles follow each other without a pause, so caches are warm; a quiet core (`taskset -c 3`, nothing else on it) makes the times
//! repeatable.

#[path = "../tests/arm/mod.rs"]
mod arm;

use std::time::Instant;

use aforce::host::{ArmInterface, Host, HostLimits, HostSetup, Status};
use aforce::{Arm, ControllerConfig, ForceConfig, Interpolation};
use arm::{BallArm, HOME};

const CYCLES: usize = 1_000_000;
/// Cycles per action.
const ACTION: usize = 50;
/// Bins of the histogram per decade.
const BINS: f64 = 10.0;

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
            force: ForceConfig { force_max: 30.0, ..ForceConfig::default() },
            ..ControllerConfig::default()
        },
        space: "aforce-force".parse()?,
    };
    let mut host = Host::new(&setup)?;
    // The arm is simulated outside the timed part. From the second cycle on its tool is pushed along +z with 0 to 20 N.
    let mut arm = BallArm::at(HOME, ArmInterface::FRANKA);
    let first = arm.state();
    host.start(&first, &first.pose)?;
    let (mut with_action, mut without) = (Vec::with_capacity(CYCLES / ACTION), Vec::with_capacity(CYCLES));
    for cycle in 0..CYCLES {
        let state = arm.state();
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
        arm.tau = command.tau;
        arm.wrench[2] = 10.0 * (1.0 + (cycle as f64 * 1e-3).sin());
        arm.advance(0.001);
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

/// Processor and kernel, as Linux reports them.
fn machine() -> String {
    let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    let cpu = read("/proc/cpuinfo");
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or("unknown processor");
    format!("{}, Linux {}", model.trim_start_matches([' ', '\t', ':']), read("/proc/sys/kernel/osrelease").trim())
}
