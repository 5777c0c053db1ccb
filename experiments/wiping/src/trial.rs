//! What varies: from one wipe to the next, and unknown to script, controller and model.

use aforce::JointVector;
use physics::Deviation;
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
    /// Seed of the wrench's bias and noise.
    pub noise_seed: u64,
}

impl Trial {
    /// In the middle of the ranges.
    pub fn nominal() -> Self {
        Trial { spot: [0.12, 0.0], height: TABLE_HEIGHT, friction: 0.3, start: HOME.into(), noise_seed: 0 }
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
            noise_seed: rng.random(),
        }
    }
}

/// What neither the script nor the controller's model knows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbance {
    /// Height of the table above where it is believed to be (m).
    pub table_offset: f64,
    /// Factor on the friction.
    pub friction: f64,
    /// Mass at the tool point (kg).
    pub payload: f64,
    /// Factor on bias and noise of the estimated wrench.
    pub wrench_error: f64,
    /// Time by which torques arrive late (s), in whole control samples.
    pub delay: f64,
}

impl Disturbance {
    /// All is as believed.
    pub const NONE: Self = Self { table_offset: 0.0, friction: 1.0, payload: 0.0, wrench_error: 1.0, delay: 0.0 };

    /// What of it only the simulation knows.
    pub(crate) fn deviation(&self) -> Deviation {
        let Disturbance { table_offset: table_height, friction, payload, .. } = *self;
        Deviation { payload, friction, table_height, ..Deviation::default() }
    }
}
