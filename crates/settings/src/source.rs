//! Where settings come from, so that errors name the file and the line.

use std::io::{Error, ErrorKind, Read, Result as IoResult};
use std::path::Path;

use aforce::record::{self, place_of};
use serde::de::DeserializeOwned;
use zip::ZipArchive;

/// Reads a TOML document.
///
/// # Errors
/// A text with place, key and what is wrong.
pub fn parse<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    record::parse(text).map_err(|problem| problem.to_string())
}

/// Longest file of settings (bytes).
const LONGEST: u64 = 4 << 20;

/// The text of a file of settings. For the zip archive of a kept policy it is that of the `config.toml` in it. At most
/// 4 MiB are read, as a device such as `/dev/zero` never ends.
///
/// # Errors
/// If the file cannot be read, is not text or is longer than 4 MiB.
pub fn text(path: &Path) -> IoResult<String> {
    let mut text = String::new();
    let file = fs_err::File::open(path)?;
    let named = |kind, problem: &str| Error::new(kind, format!("{}: {problem}", path.display()));
    let read = if path.extension().is_some_and(|ending| ending == "zip") {
        let broken =
            |error: zip::result::ZipError| named(ErrorKind::InvalidData, &format!("config.toml in it: {error}"));
        let mut archive = ZipArchive::new(file).map_err(broken)?;
        archive.by_name("config.toml").map_err(broken)?.take(LONGEST + 1).read_to_string(&mut text)
    } else {
        file.take(LONGEST + 1).read_to_string(&mut text)
    };
    read.map_err(|error| named(error.kind(), &error.to_string()))?;
    if text.len() as u64 > LONGEST {
        return Err(named(ErrorKind::InvalidData, &format!("longer than {} MiB: no file of settings", LONGEST >> 20)));
    }
    Ok(text)
}

/// Where settings come from.
#[derive(Debug, Clone)]
pub struct Source {
    name: String,
    /// The file's text; empty if the source is not a file.
    text: String,
}

impl Source {
    /// A file with this text.
    pub fn file(name: String, text: String) -> Self {
        Source { name, text }
    }

    /// A source that is not a file, such as the command line, by its name.
    pub fn named(name: impl Into<String>) -> Self {
        Source { name: name.into(), text: String::new() }
    }

    /// The source's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The source's name, and the line of a dotted key if the text has the key.
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
    fn what_never_ends_is_not_read_to_its_end() {
        let told = text(Path::new("/dev/zero")).unwrap_err().to_string();
        assert_eq!(told, "/dev/zero: longer than 4 MiB: no file of settings");
    }

    #[test]
    fn a_key_has_the_line_of_its_file() {
        let source = Source::file("a.toml".into(), "seed = 1\n[learner]\ngamma = 0.9\n".into());
        assert_eq!([source.at("learner.gamma"), source.at("learner.tau")], ["a.toml, line 3", "a.toml"]);
        assert_eq!(Source::named("command line").at("learner.gamma"), "command line");
    }
}
