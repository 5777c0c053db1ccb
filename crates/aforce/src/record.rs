//! Reads settings from TOML. An error names the line, the dotted key and, for an unknown key, the nearest known one. A table may extend
//! another.
//!
//! All settings of the workspace are read by this module. It allocates, so the control loop does not call it.

use std::fmt::{self, Display, Formatter};

use serde::de::{DeserializeOwned, Deserializer};
use toml::de::{DeTable, DeValue, Error};
use toml::{Table, Value};

/// What is wrong with a document or a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Dotted key that the problem is about; empty if it is about no single key.
    pub key: String,
    /// Line and column in the document, counted from 1; `None` if a table was read.
    pub place: Option<(usize, usize)>,
    /// What is wrong, in words, with the key.
    pub message: String,
}

impl Display for Problem {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        if let Some((line, column)) = self.place {
            write!(f, "line {line}, column {column}: ")?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for Problem {}

/// Reads a document.
///
/// # Errors
/// If the text is not TOML, or a key is missing, unknown or of the wrong type.
pub fn parse<T: DeserializeOwned>(text: &str) -> Result<T, Problem> {
    let problem = |error: &Error, key| {
        let place = error.span().map(|span| place(text, span.start));
        Problem { place, ..explain(error, key) }
    };
    let document = toml::Deserializer::parse(text).map_err(|error| problem(&error, String::new()))?;
    let _: T = deserialize(document).map_err(|(error, key)| problem(&error, key))?;
    // This first pass knows line and column, but drops the surplus elements of a list that is too long. The second pass, from a table,
    // refuses such a list.
    let table = text.parse().map_err(|error| problem(&error, String::new()))?;
    read(table).map_err(|problem| Problem { place: place_of(text, &problem.key), ..problem })
}

/// Reads a table.
///
/// # Errors
/// If a key is missing, unknown or of the wrong type.
pub fn read<T: DeserializeOwned>(table: Table) -> Result<T, Problem> {
    deserialize(table).map_err(|(error, key)| explain(&error, key))
}

/// Resolves the key `extends` of `table`: `base` returns the table that the key names, and the other keys of `table` are laid over it
/// ([`overlay`]). A table without the key `extends` is returned as it is.
///
/// # Errors
/// The error of `base`.
pub fn extended<E>(mut table: Table, base: impl FnOnce(Value) -> Result<Table, E>) -> Result<Table, E> {
    let Some(name) = table.remove("extends") else { return Ok(table) };
    let mut whole = base(name)?;
    overlay(&mut whole, table);
    Ok(whole)
}

/// Keys whose value is a choice: a name, or a table whose one key is the name (`stiffness.fixed = 150`).
const CHOICES: [&str; 3] = ["goal", "stiffness", "interpolation"];

/// Keys below which a task has settings of its own. No key below them is a choice, even if it has the name of one.
const TASKS_OWN: [&str; 2] = ["options", "own"];

/// Lays `over` on `base`: tables merge key by key, and any other value replaces that of `base`. Where `over` makes another choice of
/// `goal`, `stiffness` or `interpolation` than `base`, it replaces the choice of `base` as a whole.
pub fn overlay(base: &mut Table, over: Table) {
    merge(base, over, &CHOICES);
}

fn merge(base: &mut Table, over: Table, choices: &[&str]) {
    for (key, value) in over {
        let is_choice = choices.contains(&key.as_str());
        let below: &[&str] = if TASKS_OWN.contains(&key.as_str()) { &[] } else { choices };
        match (base.get_mut(&key), value) {
            (Some(Value::Table(old)), Value::Table(new)) if !is_choice || old.keys().eq(new.keys()) => {
                merge(old, new, below)
            }
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

/// Line and column, counted from 1, of a dotted key in a document; `None` if the document lacks the key.
#[must_use]
pub fn place_of(text: &str, key: &str) -> Option<(usize, usize)> {
    let document = DeTable::parse(text).ok()?;
    let (mut table, mut start) = (Some(document.get_ref()), None);
    for part in key.split('.') {
        let (found, value) = table?.iter().find(|(key, _)| key.get_ref() == part)?;
        start = Some(found.span().start);
        table = if let DeValue::Table(inner) = value.get_ref() { Some(inner) } else { None };
    }
    Some(place(text, start?))
}

/// Line and column, counted from 1, of the byte with this index.
fn place(text: &str, byte: usize) -> (usize, usize) {
    let before = text.get(..byte).unwrap_or(text);
    let line = before.rsplit('\n').next().unwrap_or_default();
    (before.matches('\n').count() + 1, line.chars().count() + 1)
}

/// Reads a value; an error comes with the dotted key that it is about.
fn deserialize<'de, T: DeserializeOwned, D: Deserializer<'de, Error = Error>>(from: D) -> Result<T, (Error, String)> {
    serde_path_to_error::deserialize(from).map_err(|error| {
        let key = if error.path().iter().len() == 0 { String::new() } else { error.path().to_string() };
        (error.into_inner(), key)
    })
}

/// Parts of the parser's messages for a number in place of a choice's name, in a table and in a document.
const NO_NAME: [&str; 3] = ["invalid type: unit variant", "wanted string or table", "expected a name in quotes"];
/// Parts of the parser's messages for the name of a choice without the value that the choice needs.
const NO_VALUE: [&str; 2] = ["unit variant, expected newtype variant", "unit variant, expected struct variant"];
/// The parser's names of types, and plain words for them.
const KINDS: [(&[&str], &str); 4] = [
    (&["u8", "u16", "u32", "u64", "usize"], "a whole number, 0 or above"),
    (&["i32", "i64"], "a whole number"),
    (&["f32", "f64"], "a number"),
    (&["a sequence"], "a list"),
];
/// Jaro similarity above which a known word is suggested.
const LIKE: f64 = 0.75;

/// The word of `known` that is most similar to `word`; `None` if none is similar enough to be meant.
#[must_use]
pub fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let likeness = |known: &&str| strsim::jaro(known, word);
    let best = known.iter().copied().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    best.filter(|best| likeness(best) > LIKE)
}

/// The parser's message without the names of its types.
fn in_plain_words(message: &str) -> String {
    if NO_VALUE.iter().any(|no_value| message.contains(no_value)) {
        return "not a name alone: its value is wanted, or a table with its keys".into();
    }
    if NO_NAME.iter().any(|no_name| message.contains(no_name)) {
        return "a name in quotes is wanted".into();
    }
    if message.starts_with("wanted exactly 1 element") {
        return "one choice is wanted, neither none nor several".into();
    }
    let Some((found, wanted)) = message.split_once(", expected ") else { return message.into() };
    let known = KINDS.iter().find(|(kinds, _)| kinds.contains(&wanted)).map(|(_, plain)| (*plain).to_owned());
    let list = || Some(format!("a list of {}", wanted.strip_prefix("an array of length ")?));
    let is_table = wanted == "a map" || wanted.starts_with("struct ");
    let table = || is_table.then(|| "a table".to_owned());
    match known.or_else(list).or_else(table) {
        Some(plain) => format!("{found}, expected {plain}"),
        None => message.into(),
    }
}

/// The parser's error as a [`Problem`], with the dotted key and, for an unknown key, the nearest known one.
fn explain(error: &Error, key: String) -> Problem {
    let message = error.message().replace('\n', ", ");
    // Only serde's message holds the names of the unknown key and of the known ones.
    let mut quoted = message.split('`').skip(1).step_by(2);
    let unknown = quoted.next().filter(|_| message.starts_with("unknown field"));
    let message = if let Some(unknown) = unknown {
        let section = key.strip_suffix(unknown).unwrap_or_default();
        let known: Vec<&str> = quoted.collect();
        let hint = match nearest(unknown, &known) {
            Some(nearest) => format!("did you mean \"{section}{nearest}\"?"),
            None => format!("known are {}", known.join(", ")),
        };
        format!("unknown key \"{key}\"; {hint}")
    } else {
        let wanted = in_plain_words(&message);
        if key.is_empty() { wanted } else { format!("{key}: {wanted}") }
    };
    Problem { key, place: None, message }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::action_space::ActionSpace;

    #[test]
    fn a_key_has_a_place_wherever_it_is_written() {
        let text = "seed = 1\n\n[env]\ntask = \"lift\"\nspace.stiffness = { fixed = 3 }\n[learner]\ngamma = 0.9\n";
        let places = ["seed", "env.task", "env.space.stiffness.fixed", "learner.gamma", "learner.tau", ""];
        let expected = [Some((1, 1)), Some((4, 1)), Some((5, 21)), Some((7, 1)), None, None];
        assert_eq!(places.map(|key| place_of(text, key)), expected);
    }

    #[test]
    fn what_is_wanted_is_told_without_types_of_rust() {
        for (text, wanted) in [
            ("commanded_psi = 3", "commanded_psi: invalid type: integer `3`, expected a table"),
            ("stiffness = 'adaptive'", "stiffness.adaptive: not a name alone: its value is wanted"),
            ("stiffness = { fixed = 3, adaptive = {} }", "stiffness: one choice is wanted, neither none nor several"),
        ] {
            let message = parse::<ActionSpace>(text).unwrap_err().message;
            assert!(message.contains(wanted), "{text}: {message}");
        }
        #[derive(Debug, serde::Deserialize)]
        struct Numbers {
            #[expect(dead_code)]
            count: u32,
        }
        let message = parse::<Numbers>("count = 1000.0").unwrap_err().message;
        assert_eq!(message, "count: invalid type: floating point `1000.0`, expected a whole number, 0 or above");
    }

    #[test]
    fn a_list_of_the_wrong_length_is_refused_in_a_document_too() {
        #[derive(Debug, serde::Deserialize)]
        struct Tool {
            #[expect(dead_code)]
            position: [f64; 3],
        }
        for (text, wanted) in
            [("position = [1.0, 2.0]", "a list of 3"), ("position = [1.0, 2.0, 3.0, 4.0]", "fewer elements in array")]
        {
            let problem = parse::<Tool>(text).unwrap_err();
            assert!(problem.place.is_some() && problem.key == "position", "{text}: {problem:?}");
            assert!(problem.message.ends_with(&format!("expected {wanted}")), "{text}: {problem}");
        }
        assert!(parse::<Tool>("position = [1.0, 2.0, 3.0]").is_ok());
    }

    #[test]
    fn a_choice_is_replaced_and_a_tasks_own_table_of_that_name_is_merged() {
        let text = "space.stiffness.fixed = 3\noptions.goal = { x = 1, y = 2 }";
        let mut table: Table = text.parse().unwrap();
        overlay(&mut table, "space.stiffness.commanded = {}\noptions.goal.x = 4".parse().unwrap());
        assert_eq!(table, "space.stiffness.commanded = {}\noptions.goal = { x = 4, y = 2 }".parse().unwrap());
    }

    /// A document and a table give the same error, except that only the document's has a place.
    #[test]
    fn what_is_wrong_is_told_with_its_whole_key() {
        let known = "goal = 'rebased'\n";
        for (text, place, key, message) in [
            ("fo rce = true", (1, 4), "", "key with no value, expected `=`"),
            ("forse = true", (1, 1), "forse", "unknown key \"forse\"; did you mean \"force\"?"),
            ("qqqqq = true", (1, 1), "qqqqq", "unknown key \"qqqqq\"; known are name, "),
            ("\nforce = 3", (2, 9), "force", "force: invalid type: integer `3`, expected a boolean"),
            ("rate = 3", (1, 8), "rate", "rate: a name in quotes is wanted"),
            ("rate = 'fast'", (1, 8), "rate", "rate: unknown variant `fast`, expected "),
            // The choice `adaptive` is a part of the key, which the parser itself leaves out.
            (
                "stiffness.adaptive = { k_mn = 3 }",
                (1, 24),
                "stiffness.adaptive.k_mn",
                "unknown key \"stiffness.adaptive.k_mn\"; did you mean \"stiffness.adaptive.k_min\"?",
            ),
            ("commanded_psi.ranges = [3]", (1, 25), "commanded_psi.ranges[0]", "commanded_psi.ranges[0]: "),
        ] {
            let problem = parse::<ActionSpace>(text).unwrap_err();
            assert_eq!((problem.place, problem.key.as_str()), (Some(place), key), "{text}: {problem}");
            assert!(problem.message.starts_with(message), "{text}: {problem}");
            assert!(problem.to_string().starts_with(&format!("line {}, column {}: ", place.0, place.1)), "{problem}");
            let Ok(table) = text.parse::<Table>() else { continue };
            assert_eq!(read::<ActionSpace>(table).unwrap_err(), Problem { place: None, ..problem });
        }
        let missing = parse::<ActionSpace>(known).unwrap_err();
        assert!(missing.key.is_empty() && missing.message.starts_with("missing field"), "{missing}");
    }
}
