//! What varies from one wipe to the next.

use aforce::JointVector;
use physics::robots::panda::HOME;
use physics::scenes::wipe::TABLE_HEIGHT;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// One wipe: the same for every action space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// Middle of the spot of paint (m, world).
    pub spot: [f64; 2],
    /// Height of the table top (m).
    pub height: f64,
    /// Sliding friction between tool and table.
    pub friction: f64,
    /// Joint angles at the start (rad).
    pub start: JointVector,
    /// Seed of the episode, from which the wrench's bias and noise follow.
    pub seed: u64,
}

impl Trial {
    /// The trial in the middle of all ranges.
    pub fn nominal() -> Self {
        Trial { spot: [0.12, 0.0], height: TABLE_HEIGHT, friction: 0.3, start: HOME.into(), seed: u64::MAX }
    }

    /// Trial `index` of the experiment `seed`.
    pub fn random(seed: u64, index: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(index);
        let mut around = |middle: f64, spread: f64| rng.random_range(middle - spread..middle + spread);
        let Trial { spot, height, friction, start, .. } = Trial::nominal();
        Trial {
            spot: [around(spot[0], 0.05), around(spot[1], 0.15)],
            height: around(height, 0.02),
            friction: around(friction, 0.1),
            start: start.map(|q| around(q, 0.02)),
            // An environment draws bias and noise from the complement of its seed, which here is the number that was drawn.
            seed: !rng.random::<u64>(),
        }
    }
}
