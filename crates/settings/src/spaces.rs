//! Action spaces as settings name them: a built-in name, a file, or a table in a configuration.

use std::path::Path;

use aforce::ActionSpace;
use aforce::record;
use anyhow::{Context, Result, bail, ensure};
use toml::{Table, Value};

/// A built-in space by its name, or a user's own record from a file that ends with `.toml`, whose path is relative to `folder`. Without
/// a `name` the record has the name of its file.
///
/// # Errors
/// Names the file, the key and what is allowed.
pub fn named(text: &str, folder: &Path) -> Result<ActionSpace> {
    if !text.ends_with(".toml") {
        ensure!(!text.contains(['.', '/']), "{text}: the name of a file with an action space ends with .toml");
        return Ok(text.parse()?);
    }
    let path = folder.join(text);
    let table: Table = record::parse(&crate::text(&path)?).with_context(|| path.display().to_string())?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    own(table, &stem).with_context(|| path.display().to_string())
}

/// The space that a value of a configuration stands for: a name or a file, as [`named`] has it, or a table with a record.
///
/// # Errors
/// As [`named`].
pub fn of_value(value: Value, folder: &Path) -> Result<ActionSpace> {
    match value {
        Value::String(text) => named(&text, folder),
        Value::Table(table) => {
            ensure!(table.contains_key("name"), "an action space of one's own needs a name");
            own(table, "")
        }
        other => bail!("{other}: an action space is a name, a file or a table"),
    }
}

/// A user's own record. Tables tell spaces apart by their names, so it must not have the name of a different built-in space.
fn own(table: Table, name: &str) -> Result<ActionSpace> {
    let space = ActionSpace::from_table(table, name)?;
    if let Ok(built_in) = space.name.parse::<ActionSpace>() {
        ensure!(
            built_in == space,
            "name = {:?} is a built-in action space, and another one: choose another name",
            space.name
        );
    }
    Ok(space)
}

/// Resolves the `env.space` of a layer of settings: a name, a file or a table that extends a built-in space becomes a
/// complete record. A table of single keys is left as it is: it changes the space of the layers below.
///
/// # Errors
/// As [`named`].
pub fn work_out(layer: &mut Table, folder: &Path) -> Result<()> {
    let Some(space) = layer.get_mut("env").and_then(|env| env.get_mut("space")) else { return Ok(()) };
    if space.as_table().is_some_and(|table| !table.contains_key("extends") && !is_whole(table)) {
        return Ok(());
    }
    // A complete record may have a built-in space's name and other numbers: an earlier program's, or one with changes.
    let whole = space.as_table().is_some_and(is_whole);
    if !whole {
        *space = Value::try_from(of_value(space.clone(), folder).context("env.space")?)?;
    }
    Ok(())
}

/// Removes the space from `base` if the layer replaces it as a whole, so that no value of one space stays in another.
pub(crate) fn make_room(base: &mut Table, layer: &Table) {
    let replaces = layer.get("env").and_then(|env| env.get("space")?.as_table()).is_some_and(is_whole);
    if replaces && let Some(Value::Table(env)) = base.get_mut("env") {
        env.remove("space");
    }
}

/// Whether a table is a complete record, not changes of one.
fn is_whole(table: &Table) -> bool {
    ["name", "goal", "stiffness"].iter().all(|key| table.contains_key(*key)) && !table.contains_key("extends")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(result: Result<ActionSpace>) -> String {
        format!("{:#}", result.unwrap_err())
    }

    #[test]
    fn a_file_is_a_space_with_its_name() {
        let folder = tempfile::tempdir().unwrap();
        fs_err::write(folder.path().join("soft.toml"), "extends = 'osc-force'\nstiffness.fixed = 45").unwrap();
        let soft = named("soft.toml", folder.path()).unwrap();
        assert_eq!((soft.name.as_str(), soft.force), ("soft", true));
        assert_eq!(named("osc", folder.path()).unwrap().name, "osc");
        for (text, words) in [
            ("stiffness.fixed = 45", ["soft.toml", "missing field"]),
            ("extends = 'osc'\nstifness.fixed = 45", ["soft.toml", "stifness"]),
            ("extends = 'osc'\nname = 'low'", ["soft.toml", "\"low\" is a built-in"]),
            ("extends = 'osc'\nextends = 'low'", ["soft.toml", "line 2"]),
            ("extends = 'osk'", ["soft.toml", "did you mean `osc`"]),
        ] {
            fs_err::write(folder.path().join("soft.toml"), text).unwrap();
            let error = error(named("soft.toml", folder.path()));
            assert!(words.iter().all(|word| error.matches(word).count() == 1), "{text}: {error}");
        }
        assert!(error(named("none.toml", folder.path())).contains("none.toml"));
        assert!(error(named("soft.json", folder.path())).contains("ends with .toml"));
        assert!(error(named("aforze", folder.path())).contains("did you mean `aforce`"));
    }

    #[test]
    fn a_table_needs_a_name() {
        let of = |text: &str| of_value(text.parse::<Table>().unwrap().remove("s").unwrap(), Path::new(""));
        assert_eq!(of("s = { name = 'mine', extends = 'low' }").unwrap().name, "mine");
        assert!(error(of("s = { extends = 'low' }")).contains("needs a name"));
        assert!(error(of("s = 3")).contains("a name, a file or a table"));
    }
}
