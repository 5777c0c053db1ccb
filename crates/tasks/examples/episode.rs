//! Plays given actions. `episode TASK SPACE SEED HORIZON < actions.csv` reads a row per action and prints after each action the reward, the
//! energy (J), the observation, the largest sustained force on the whole arm and beyond the wrist (N), the largest joint speed as a share
//! of its limit, and the penalty. A test of the Python package compares its environments with these numbers.

use std::error::Error;
use std::io::stdin;

use tasks::{Env, EnvConfig};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [task, space, seed, horizon] = arguments.as_slice() else {
        return Err("usage: episode TASK SPACE SEED HORIZON".into());
    };
    let (task, space, horizon) = (task.parse()?, space.parse()?, horizon.parse()?);
    let mut env = Env::new(EnvConfig { task, space, horizon, ..EnvConfig::of(task) }, 0)?;
    env.reset(Some(seed.parse()?));
    for line in stdin().lines() {
        let action = line?.split(',').map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        let step = env.step(&action);
        // The shortest decimals that read back as the same numbers.
        let observation: Vec<String> = env.observation().iter().map(f32::to_string).collect();
        let interval = step.interval;
        let cost = [interval.arm.max, interval.hand.max, interval.max_speed_share, step.penalty].map(|n| n.to_string());
        println!("{},{},{},{}", step.reward, interval.energy.absolute, observation.join(","), cost.join(","));
    }
    Ok(())
}
