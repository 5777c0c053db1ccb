//! Plays an episode and shows it: as a page for a browser, as pictures, curves or tables.
//!
//! This crate needs no libtorch: a closure from the environment to an action plays the episode.
//!
//! ```
//! use show::{Playback, page};
//! use tasks::{Env, EnvConfig};
//!
//! let mut env = Env::new(EnvConfig::default(), 0)?;
//! let playback = Playback::play(&mut env, Env::expert_action, 3, 5, "scripted expert", |_, _, _| Ok(()))?;
//! let file = std::env::temp_dir().join(format!("show_example_{}.html", std::process::id()));
//! page::write(&file, &[playback], &[])?;
//! # std::fs::remove_file(file)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod arrow;
mod axis;
mod caption;
mod inputs;
pub mod page;
pub mod palette;
pub mod picture;
mod playback;
pub mod plot;
mod recording;
pub mod sheet;
mod traces;
mod view;

pub use playback::Playback;
pub use recording::Recording;
pub use traces::Traces;
pub use view::View;
