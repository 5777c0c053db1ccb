//! Where settings come from, so that what is wrong with one is told with its place.

use aforce::record::{self, place_of};
use serde::de::DeserializeOwned;

/// Reads a TOML document.
///
/// # Errors
/// In words: place, key and what is wrong.
pub fn parse<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    record::parse(text).map_err(|problem| problem.to_string())
}

/// Where settings come from.
#[derive(Debug, Clone)]
pub struct Source {
    name: String,
    /// What is written there; empty if it is no file.
    text: String,
}

impl Source {
    /// A file with this text.
    pub fn file(name: String, text: String) -> Self {
        Source { name, text }
    }

    /// Something else, by its name.
    pub fn named(name: impl Into<String>) -> Self {
        Source { name: name.into(), text: String::new() }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its name, and the line of a dotted key where there is one.
    pub fn at(&self, key: &str) -> String {
        match place_of(&self.text, key) {
            Some((line, _)) => format!("{}, line {line}", self.name),
            None => self.name.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_has_the_line_of_its_file() {
        let source = Source::file("a.toml".into(), "seed = 1\n[learner]\ngamma = 0.9\n".into());
        assert_eq!([source.at("learner.gamma"), source.at("learner.tau")], ["a.toml, line 3", "a.toml"]);
        assert_eq!(Source::named("command line").at("learner.gamma"), "command line");
    }
}
