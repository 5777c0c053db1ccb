//! TOML that people write: what is wrong with it is told with line, key and the nearest known key.

use serde::de::DeserializeOwned;
use toml::Table;
use toml::de::{DeTable, DeValue};

/// Reads a TOML document.
///
/// # Errors
/// Tells the line and the key.
pub fn parse<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    toml::from_str(text).map_err(|error| {
        let before = error.span().map(|span| &text[..span.start.min(text.len())]);
        let line = before.map_or(String::new(), |before| format!("line {}: ", before.matches('\n').count() + 1));
        format!("{line}{}", explain(&error, &Table::new()).message)
    })
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
        match line_of(&self.text, key) {
            Some(line) => format!("{}, line {line}", self.name),
            None => self.name.clone(),
        }
    }
}

/// The line of a dotted key in a TOML document.
fn line_of(text: &str, key: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let (mut table, mut start) = (Some(document.get_ref()), None);
    for part in key.split('.') {
        let (found, value) = table?.iter().find(|(key, _)| key.get_ref() == part)?;
        start = Some(found.span().start);
        table = if let DeValue::Table(inner) = value.get_ref() { Some(inner) } else { None };
    }
    Some(text[..start?].matches('\n').count() + 1)
}

/// What is wrong with a setting.
pub(crate) struct Problem {
    /// Its dotted key; empty if that is not known.
    pub key: String,
    /// In words.
    pub message: String,
}

/// Likeness (Jaro) from which on a known key may be what was meant.
const LIKE: f64 = 0.75;

/// The parser's message with the dotted key that it is about in `settings`, and the nearest known key for an unknown one.
pub(crate) fn explain(error: &toml::de::Error, settings: &Table) -> Problem {
    // The key is told by `Display` alone, on the last line.
    let text = error.to_string();
    let key = text.lines().find_map(|line| line.strip_prefix("in `")?.strip_suffix('`')).unwrap_or_default();
    let message = error.message();
    let mut quoted = message.split('`').skip(1).step_by(2);
    let unknown = quoted.next().filter(|_| message.starts_with("unknown field"));
    let Some(unknown) = unknown else {
        let key = with_choices(key, settings);
        let wanted = if message.contains(NO_NAME) { "a name in quotes is wanted" } else { message };
        let message = if key.is_empty() { wanted.into() } else { format!("{key}: {wanted}") };
        return Problem { key, message };
    };
    let section = key.strip_suffix(unknown).unwrap_or(key).trim_end_matches('.');
    let key = if section.is_empty() { unknown.into() } else { format!("{section}.{unknown}") };
    let key = with_choices(&key, settings);
    let section = key.strip_suffix(unknown).unwrap_or_default();
    let known: Vec<&str> = quoted.collect();
    let likeness = |known: &&str| strsim::jaro(known, unknown);
    let hint = match known.iter().copied().max_by(|a, b| likeness(a).total_cmp(&likeness(b))) {
        Some(nearest) if likeness(&nearest) > LIKE => format!("did you mean \"{section}{nearest}\"?"),
        _ => format!("known are {}", known.join(", ")),
    };
    Problem { message: format!("unknown key \"{key}\"; {hint}"), key }
}

/// What the parser says of a number where the name of a choice is wanted.
const NO_NAME: &str = "invalid type: unit variant";

/// A dotted key with the choices on its way, tables with one key, which the parser leaves out.
fn with_choices(key: &str, settings: &Table) -> String {
    let (mut table, mut whole) = (Some(settings), vec![]);
    for part in key.split('.') {
        let only =
            table.filter(|table| table.len() == 1 && !table.contains_key(part)).and_then(|table| table.iter().next());
        if let Some((choice, inner)) = only.filter(|(_, inner)| inner.get(part).is_some()) {
            whole.push(choice.as_str());
            table = inner.as_table();
        }
        whole.push(part);
        table = table.and_then(|table| table.get(part)?.as_table());
    }
    whole.join(".")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_has_a_line_wherever_it_is_written() {
        let text = "seed = 1\n\n[env]\ntask = \"lift\"\nspace.stiffness = { fixed = 3 }\n[learner]\ngamma = 0.9\n";
        let lines = ["seed", "env.task", "env.space.stiffness.fixed", "learner.gamma", "learner.tau", ""];
        assert_eq!(lines.map(|key| line_of(text, key)), [Some(1), Some(4), Some(5), Some(7), None, None]);
        assert_eq!(Source::file("a.toml".into(), text.into()).at("learner.gamma"), "a.toml, line 7");
    }
}
