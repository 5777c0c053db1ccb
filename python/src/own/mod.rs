//! Tasks that are written in Python: a class defines scene, draws, observation, reward, success and script. The loop is that of every
//! other task.

mod answer;
mod blueprint;
mod bodies;
mod scene;
mod start;
mod state;
mod task;
mod values;
mod waypoint;

use std::collections::HashSet;
use std::sync::Mutex;

pub use self::blueprint::env;
pub use self::state::{Place, State};
pub use self::task::Trouble;

/// A string of a Python task that lives as long as the program, as the Rust side wants it. Equal strings are kept once.
fn for_ever(word: &str) -> &'static str {
    static WORDS: Mutex<Option<HashSet<&'static str>>> = Mutex::new(None);
    let mut words = WORDS.lock().expect("nobody panics with it");
    let words = words.get_or_insert_default();
    if let Some(known) = words.get(word) {
        return known;
    }
    let word: &'static str = Box::leak(word.to_owned().into_boxed_str());
    words.insert(word);
    word
}
