//! TOML that people write: what is wrong with it is told with line, key and the nearest known key.

use serde::de::DeserializeOwned;
use toml::Table;

/// Reads a TOML document; an error tells the line and the key.
pub fn parse<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    toml::from_str(text).map_err(|error| {
        let before = error.span().map(|span| &text[..span.start.min(text.len())]);
        let line = before.map_or(String::new(), |before| format!("line {}: ", before.matches('\n').count() + 1));
        format!("{line}{}", explain(&error, &Table::new()))
    })
}

/// Likeness (Jaro) from which on a known key may be what was meant.
const LIKE: f64 = 0.75;

/// The parser's message with the dotted key that it is about in `settings`, and the nearest known key for an unknown one.
pub(crate) fn explain(error: &toml::de::Error, settings: &Table) -> String {
    // The key is told by `Display` alone, on the last line.
    let text = error.to_string();
    let key = text.lines().find_map(|line| line.strip_prefix("in `")?.strip_suffix('`'));
    let message = error.message();
    let mut quoted = message.split('`').skip(1).step_by(2);
    let unknown = quoted.next().filter(|_| message.starts_with("unknown field"));
    let Some(unknown) = unknown else {
        return key.map_or(message.into(), |key| format!("{key}: {message}"));
    };
    let section = key.map_or("", |key| key.strip_suffix(unknown).unwrap_or(key).trim_end_matches('.'));
    let section = if section.is_empty() { String::new() } else { format!("{}.", with_choice(section, settings)) };
    let known: Vec<&str> = quoted.collect();
    let likeness = |known: &&str| strsim::jaro(known, unknown);
    let hint = match known.iter().copied().max_by(|a, b| likeness(a).total_cmp(&likeness(b))) {
        Some(nearest) if likeness(&nearest) > LIKE => format!("did you mean \"{section}{nearest}\"?"),
        _ => format!("known are {}", known.join(", ")),
    };
    format!("unknown key \"{section}{unknown}\"; {hint}")
}

/// The dotted key of a section. Where that is a choice, a table with one key, the parser leaves this one out.
fn with_choice(section: &str, settings: &Table) -> String {
    let mut table = Some(settings);
    for part in section.split('.') {
        table = table.and_then(|table| table.get(part)?.as_table());
    }
    match table.filter(|table| table.len() == 1).and_then(|table| table.keys().next()) {
        Some(choice) => format!("{section}.{choice}"),
        None => section.into(),
    }
}
