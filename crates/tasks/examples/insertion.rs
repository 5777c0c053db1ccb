//! How often the script of Insert puts the peg in: `insertion EPISODES` prints a table, one row per action space and clearance.
//! An episode ends when the peg is in. Forces are the largest ones of an episode, sustained (12 Hz) and of a single step.

use std::ops::ControlFlow;
use std::{env, process};

use aforce::ActionSpace;
use tasks::{Env, EnvConfig, Outcome, Step, TaskName, play};
use toml::Value;

/// The controllers of FORGE and of Factory as action spaces: K in N/m and Nm/rad, damped against standstill.
const GAINS: [(&str, &str); 2] = [("factory", "[100.0, 30.0]"), ("forge", "[565.0, 28.0]")];

/// Clearances (mm).
const CLEARANCES: [f64; 4] = [3.0, 1.0, 0.5, 0.114];

fn spaces() -> Vec<ActionSpace> {
    let built_in = ["mid", "aforce-force"].map(|name| name.parse().expect("a built-in space"));
    let own = GAINS.map(|(name, gains)| {
        let table = format!("extends = \"low\"\nstiffness.fixed = {gains}").parse().expect("a table");
        ActionSpace::from_table(table, name).expect("a space")
    });
    built_in.into_iter().chain(own).collect()
}

/// The `share` quantile of `numbers` as text; empty without numbers.
fn quantile(mut numbers: Vec<f64>, share: f64) -> String {
    numbers.sort_by(f64::total_cmp);
    let rank = (share * numbers.len() as f64).ceil() as usize;
    numbers.get(rank.saturating_sub(1)).map_or(String::new(), |number| format!("{number:.2}"))
}

fn until_in(_: &Env, step: &Step) -> ControlFlow<()> {
    if step.success { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

fn row(space: &ActionSpace, clearance: f64, episodes: u64) -> String {
    let mut config = EnvConfig { space: space.clone(), ..EnvConfig::of(TaskName::INSERT) };
    config.options.insert("clearance_mm".into(), Value::Float(clearance));
    let mut env = Env::new(config, 0).expect("the options are allowed");
    let outcomes: Vec<Outcome> =
        (0..episodes).map(|seed| play(&mut env, Env::expert_action, seed, until_in).outcome()).collect();
    let all = |column: &str| outcomes.iter().filter_map(|outcome| outcome.number(column)).collect::<Vec<f64>>();
    let inserted = outcomes.iter().filter(|outcome| outcome.flag("success_any")).count();
    let cells = [
        quantile(all("time_to_success_s"), 0.5),
        quantile(all("max_contact_force_n"), 0.5),
        quantile(all("max_contact_force_n"), 0.9),
        quantile(all("max_raw_contact_force_n"), 0.5),
    ];
    format!("{space},{clearance},{inserted},{episodes},{}", cells.join(","))
}

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let Some(episodes) = arguments.first().and_then(|text| text.parse::<u64>().ok()) else {
        eprintln!("usage: insertion EPISODES");
        process::exit(2)
    };
    println!("space,clearance_mm,inserted,episodes,median_time_s,median_force_n,q90_force_n,median_raw_force_n");
    for space in spaces() {
        for clearance in CLEARANCES {
            println!("{}", row(&space, clearance, episodes));
        }
    }
}
