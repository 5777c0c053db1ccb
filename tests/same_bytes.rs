//! The same bytes on another processor: glibc chooses the instructions of its sin, exp or log by what the processor offers,
//! and their last bits differ. Episodes may not depend on them.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::process::Command;

use physics::robots::RobotName;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tasks::{Env, EnvConfig, TaskName};

/// Set in a child process, which prints what its parent compares.
const CHILD: &str = "SAME_BYTES_CHILD";

/// What makes glibc (2.33 or later) believe in a processor without these instructions.
const OLDER: &str = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F";

/// Observations, rewards and energies of 60 actions, random (`true`) or the expert's, to the last bit.
fn digest(config: EnvConfig, random: bool) -> u64 {
    let mut env = Env::new(config, 1).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut digest = DefaultHasher::new();
    env.reset(Some(3)).iter().for_each(|v| v.to_bits().hash(&mut digest));
    for _ in 0..60 {
        let action: Vec<f64> = if random {
            (0..env.action_dim()).map(|_| rng.random_range(-1.0..1.0)).collect()
        } else {
            env.expert_action()
        };
        let step = env.step(&action);
        assert!(!step.diverged);
        env.observation().iter().for_each(|v| v.to_bits().hash(&mut digest));
        let y = env.measurement();
        for v in [step.reward, step.interval.energy.absolute].iter().chain(&y.q).chain(&y.qd).chain(&action) {
            v.to_bits().hash(&mut digest);
        }
    }
    digest.finish()
}

/// A line for each task, arm, space and kind of actions.
fn digests() -> String {
    let mut lines = String::new();
    let robosuite = ["aforce-force", "aforce-psi", "variable", "osc", "robosuite-osc"];
    let setups = robosuite.map(|space| (space, RobotName::Robosuite)).into_iter();
    for (space, robot) in setups.chain([("aforce", RobotName::Identified)]) {
        for task in TaskName::BUILT_IN {
            for random in [true, false] {
                let config =
                    EnvConfig { task, space: space.parse().unwrap(), robot: robot.into(), ..EnvConfig::default() };
                let digest = digest(config, random);
                lines += &format!("DIGEST {} {space} {robot:?} random={random} {digest:016x}\n", task.as_str());
            }
        }
    }
    lines
}

/// A digest of what the platform's own sine says, which does depend on glibc's choice.
fn platforms_sine() -> u64 {
    let mut digest = DefaultHasher::new();
    (0..100_000).for_each(|i| (1e-3 * f64::from(i)).sin().to_bits().hash(&mut digest));
    digest.finish()
}

/// What this test, run in a child process under `tunables`, prints: the platform's sine, and its digests.
fn digests_under(tunables: &str) -> (String, Vec<String>) {
    let child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "episodes_do_not_depend_on_the_instructions_that_glibc_picks", "--nocapture"])
        .env(CHILD, "")
        .env("GLIBC_TUNABLES", tunables)
        .output()
        .unwrap();
    assert!(child.status.success(), "{}", String::from_utf8_lossy(&child.stderr));
    let printed = String::from_utf8(child.stdout).unwrap();
    let lines = |begin| printed.lines().filter(move |line| line.starts_with(begin)).map(str::to_owned);
    (lines("SINE").next().expect("a line of the sine"), lines("DIGEST").collect())
}

#[test]
fn episodes_do_not_depend_on_the_instructions_that_glibc_picks() {
    if std::env::var_os(CHILD).is_some() {
        print!("\nSINE {:016x}\n{}", platforms_sine(), digests());
        return;
    }
    let ((sine, here), (older_sine, older)) = (digests_under(""), digests_under(OLDER));
    if is_x86_feature_detected!("fma") && cfg!(target_env = "gnu") {
        assert!(sine != older_sine, "glibc did not take other instructions: nothing was tested");
    }
    assert_eq!([here.len(), older.len()], [48; 2]);
    let differing: Vec<_> = here.iter().zip(&older).filter(|(a, b)| a != b).collect();
    assert!(differing.is_empty(), "{} of {}: {differing:#?}", differing.len(), here.len());
}
