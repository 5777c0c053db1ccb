//! Digests of episodes, to the last bit: two machines behave alike if theirs are the same.

use std::hash::{DefaultHasher, Hash, Hasher};

use aforce::{ActionSpace, Interpolation};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tasks::{Env, EnvConfig, TaskName};

/// The action spaces of the digests.
const SPACES: [&str; 8] = ["aforce", "aforce-force", "aforce-psi", "aforce-shaped", "low", "high", "variable", "osc"];
/// Number of episodes in a line's first digest.
pub const FIRST: u32 = 10;
/// Actions of an episode. Every tenth episode plays the script, which takes time to come into contact; the others play random actions.
const SCRIPTED: u32 = 100;
const RANDOM: u32 = 6;

/// A line for each task and space: a digest of its first [`FIRST`] episodes, or of all if they are fewer, and one of all episodes if
/// they are more. Each line is computed when the iterator comes to it.
///
/// Jerk-limited set-points have a line of the first episodes alone. Their generator takes atan2 from the platform, and glibc does not round
/// one result in a thousand to the nearest number.
pub fn lines(episodes: u32) -> impl Iterator<Item = String> {
    TaskName::BUILT_IN.into_iter().flat_map(move |task| {
        let of_space = move |name: &str| {
            let space: ActionSpace = name.parse().expect("a built-in space");
            line(&format!("{} {name}", task.as_str()), EnvConfig { space, ..EnvConfig::of(task) }, episodes)
        };
        let jerk_limited = move || {
            let mut config = EnvConfig::of(task);
            config.controller.interpolation = Interpolation::JerkLimited { dynamics: 0.5 };
            line(&format!("{} aforce,jerk-limited", task.as_str()), config, episodes.min(FIRST))
        };
        SPACES.into_iter().map(of_space).chain(std::iter::once_with(jerk_limited))
    })
}

fn line(name: &str, config: EnvConfig, episodes: u32) -> String {
    let mut env = Env::new(config, 1).expect("a built-in set-up");
    let mut hash = DefaultHasher::new();
    let mut line = name.to_owned();
    for episode in 0..episodes {
        play(&mut env, episode, &mut hash);
        if episode + 1 == FIRST.min(episodes) || episode + 1 == episodes {
            line += &format!(" {:016x}", hash.finish());
        }
    }
    line
}

/// Plays an episode and hashes each action's observation, reward, energy, impulse, joint angles and joint velocities.
fn play(env: &mut Env, episode: u32, hash: &mut DefaultHasher) {
    let scripted = episode.is_multiple_of(10);
    let mut rng = ChaCha8Rng::seed_from_u64(episode.into());
    env.reset(Some(episode.into()));
    for _ in 0..if scripted { SCRIPTED } else { RANDOM } {
        let mut random = || (0..env.action_dim()).map(|_| rng.random_range(-1.0..1.0)).collect();
        let action: Vec<f64> = if scripted { env.expert_action() } else { random() };
        let step = env.step(&action);
        env.observation().iter().for_each(|v| v.to_bits().hash(hash));
        let y = env.measurement();
        let numbers = [step.reward, step.interval.energy.absolute, step.interval.arm.impulse];
        numbers.iter().chain(&y.q).chain(&y.qd).for_each(|v| v.to_bits().hash(hash));
        if step.terminated {
            return;
        }
    }
}
