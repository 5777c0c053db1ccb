//! The paper's wiping experiment (AFORCE, arXiv 2110.09904, figure 3) in simulation: a Panda controlled at 1 kHz wipes a
//! spot of paint off a table, driven by a script at 20 Hz. Nothing is learned.
//!
//! [`simulate`] plays the script in an environment of [`tasks`]; [`Setup`] is everything that is fixed, [`Trial`] what varies from
//! one wipe to the next, and [`tasks::Disturbance`] what the script and the controller's model do not know. The four parts of the
//! experiment each write their own files.

pub mod comparison;
pub mod conditions;
pub mod delta_sign;
pub mod evolution;
mod metrics;
mod record;
mod run;
mod setup;
mod spaces;
mod trial;

pub use record::{Outcome, Record, Sample};
pub use run::{Run, simulate};
pub use setup::Setup;
pub use spaces::{AFORCE, HIGH};
pub use trial::Trial;
