//! `bits [EPISODES]` (10 by default): digests of episodes on this machine, a line for each task and action space.

use std::{env, process};

fn main() {
    let Ok(episodes) = env::args().nth(1).map_or(Ok(live::bits::FIRST), |text| text.parse()) else {
        eprintln!("usage: bits [EPISODES], a whole number");
        process::exit(2)
    };
    for line in live::bits::lines(episodes) {
        println!("{line}");
    }
}
