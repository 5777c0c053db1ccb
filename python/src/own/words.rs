//! Words of a task in Python that the Rust side keeps.

use std::collections::HashSet;
use std::sync::Mutex;

/// A word that lives as long as the program; the same word once.
pub fn for_ever(word: &str) -> &'static str {
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
