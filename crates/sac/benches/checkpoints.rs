//! Bytes that a run writes into its checkpoints. `cargo bench -p sac --bench checkpoints -- 10000000` imitates a run of 10 million actions,
//! with the sizes of the Lift task and the settings of `swift`, that saves a checkpoint every 50 000 actions, as `train` does.

use sac::{Checkpoint, Preset, Replay, Sac, Transition};

const OBSERVATIONS: usize = 42;
const ACTIONS: usize = 7;
/// Actions between checkpoints, and actions in an episode.
const SAVE_EVERY: usize = 50_000;
const EPISODE: usize = 500;

fn main() {
    // Cargo adds `--bench`.
    let count = std::env::args().skip(1).find(|argument| argument != "--bench");
    let actions: usize = count.map_or(500_000, |count| count.parse().expect("the argument is a number of actions"));
    let config = Preset::SWIFT.settings();
    let sac = Sac::new(&config, (OBSERVATIONS, ACTIONS), 1).unwrap();
    let mut replay = Replay::new(&config, (OBSERVATIONS, ACTIONS));
    let folder = tempfile::tempdir_in(".").unwrap();
    let before = written();
    for k in 1..=actions {
        let step = Transition {
            observation: &[k as f32; OBSERVATIONS],
            action: &[0.5; ACTIONS],
            reward: 0.1,
            next_observation: &[k as f32 + 1.0; OBSERVATIONS],
            terminated: false,
            truncated: k % EPISODE == 0,
        };
        replay.push(&step).unwrap();
        if k % SAVE_EVERY == 0 {
            Checkpoint::save(&folder.path().join("last"), &sac, Some(&replay), serde_json::Value::Null).unwrap();
        }
    }
    println!("actions,written_gb");
    println!("{actions},{:.3}", (written() - before) as f64 / 1e9);
}

/// Bytes that this process has written so far, as Linux counts them.
fn written() -> u64 {
    let counters = std::fs::read_to_string("/proc/self/io").expect("Linux counts them");
    let count =
        counters.lines().find_map(|line| line.strip_prefix("wchar: ")).expect("the counter of what was written");
    count.parse().expect("a number")
}
