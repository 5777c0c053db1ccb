//! Random actions as torques: `random_torques lift|door|wipe STEPS FILE` writes one line for each of STEPS random
//! `variable` actions, for another simulator to repeat.
//!
//! The numbers of a line (SI units) are the mean torque of each joint of the arm during the action, then the state of
//! the scene before the action, in MuJoCo's order. Positions come first: of the joints, and in Lift the cube's position
//! and quaternion w, x, y, z. Then velocities: of the joints, and in Lift the cube's linear (world axes) and angular
//! velocity (its own axes).

use std::fmt::Write;
use std::{env, fs, process};

use aforce::Vector3;
use physics::Simulation;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tasks::{Env, EnvConfig, TaskName};

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [task, steps, file] = arguments.as_slice() else { usage() };
    let (Ok(task), Ok(steps)) = (task.parse::<TaskName>(), steps.parse::<u32>()) else { usage() };
    let Some(joints) = joints(task) else { usage() };
    let space = "variable".parse().expect("a built-in space");
    let mut env = Env::new(EnvConfig { task, space, ..EnvConfig::default() }, 1).expect("defaults are valid");
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut out = String::new();
    for _ in 0..steps {
        let before = state(task, joints, env.simulation());
        let action: Vec<f64> = (0..env.action_dim()).map(|_| rng.random_range(-1.0..=1.0)).collect();
        let step = env.step(&action);
        let torque = step.interval.mean_torque();
        let line: Vec<String> = torque.iter().chain(&before).map(f64::to_string).collect();
        writeln!(out, "{}", line.join(",")).expect("memory");
        if step.terminated || step.truncated {
            env.reset(None);
        }
    }
    fs::write(file, out).expect("the file is writable");
}

/// Number of joints in a task's scene: the arm's, then the gripper's and the door's. `None` for a task that robosuite does not have.
fn joints(task: TaskName) -> Option<usize> {
    match task.as_str() {
        "lift" => Some(9),
        "door" => Some(11),
        "wipe" => Some(7),
        _ => None,
    }
}

fn state(task: TaskName, joints: usize, simulation: &Simulation) -> Vec<f64> {
    let (mut positions, mut velocities): (Vec<f64>, Vec<f64>) = (0..joints).map(|i| simulation.joint(i)).unzip();
    if task == TaskName::LIFT {
        let cube = simulation.solids().last().and_then(|solid| solid.body).expect("the cube comes last and moves");
        let (pose, velocity) = (simulation.body_pose(cube), simulation.body_velocity(cube));
        let q = pose.rotation;
        positions.extend(pose.translation.vector.iter().chain(&[q.w, q.i, q.j, q.k]));
        velocities.extend(velocity.fixed_rows::<3>(0).iter());
        let turn: Vector3 = velocity.fixed_rows::<3>(3).into_owned();
        velocities.extend((q.inverse() * turn).iter());
    }
    positions.extend(velocities);
    positions
}

fn usage() -> ! {
    eprintln!("usage: random_torques lift|door|wipe STEPS FILE");
    process::exit(2)
}
