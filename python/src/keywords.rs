//! Settings from Python: keywords with the names and meanings of the keys below `env` in a configuration file.

use std::path::{Path, PathBuf};

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyByteArray, PyBytes, PyDict, PyFloat, PyInt, PyMapping, PySequence, PyString};
use settings::{RUN_KEYS, Source, spaces};
use tasks::{EnvConfig, TaskName};
use toml::{Table, Value};

use crate::{type_error, value_error};

/// Largest depth of nested settings. It ends the recursion if a dictionary contains itself.
const DEEPEST: usize = 16;

/// The name of this layer of settings in messages.
const SOURCE: &str = "keywords";

/// Keys of an environment that the table of its defaults lacks, as they are unset by default.
const UNTOLD: [&str; 2] = ["options", "stop_price"];

/// Keywords that are no keys of an environment.
const PYTHONS_OWN: [&str; 5] = ["config", "render_mode", "render_size", "scaled", "setup"];

/// Settings of an environment of the built-in `task`: its defaults, then a run's `config.toml` if one is given, then keywords.
///
/// # Errors
/// `TypeError` for an unknown keyword or an object that is no setting at all, `OSError` if the file cannot be read, else `ValueError` with the
/// message that a program gives.
pub fn env_config(task: &str, config: Option<PathBuf>, keywords: &Bound<'_, PyDict>) -> PyResult<EnvConfig> {
    let wanted = TaskName::BUILT_IN.into_iter().find(|name| name.as_str() == task);
    let known = || TaskName::BUILT_IN.map(|name| name.as_str()).join(", ");
    let wanted = wanted.ok_or_else(|| value_error(format!("no task is called {task:?}; there are {}", known())))?;
    config_of(wanted, None, config, keywords)
}

/// Settings of an environment of a task: the task's own `defaults`, if it has some, with their name in messages, then a file, then keywords.
///
/// # Errors
/// As [`env_config`].
pub fn config_of(
    wanted: TaskName,
    defaults: Option<(&str, &Bound<'_, PyDict>)>,
    config: Option<PathBuf>,
    keywords: &Bound<'_, PyDict>,
) -> PyResult<EnvConfig> {
    let base = EnvConfig::of(wanted);
    let known = Table::try_from(&base).map_err(value_error)?;
    let mut layers = vec![];
    // Set if a key is unknown: the error is then a `TypeError` that begins with this text. For a keyword the text is that
    // of Python itself, as libraries that try keywords look for this type and these words.
    let mut unknown = None;
    let mut layer = |name: &str, dict: &Bound<'_, PyDict>| -> PyResult<_> {
        let is_known = |key: &str| UNTOLD.contains(&key) || key == "setup" || known.contains_key(key);
        let mut env = Table::new();
        for (key, value) in dict.iter() {
            let key = named(&key)?;
            if is_known(&key) {
                env.extend(entry(key, &value, 1)?);
            } else {
                let words = || format!("got an unexpected keyword argument '{key}': ");
                unknown = Some(if name == SOURCE { words() } else { String::new() });
                // The value does not matter: the error is about the key.
                env.insert(key, Value::Boolean(true));
            }
        }
        let setup = env.remove("setup").map(|setup| ("setup".to_string(), setup));
        let mut layer = Table::from_iter([("env".to_string(), Value::Table(env))].into_iter().chain(setup));
        spaces::work_out(&mut layer, Path::new("")).map_err(value_error)?;
        Ok((Source::named(name), layer))
    };
    if let Some((name, dict)) = defaults {
        layers.push(layer(name, dict)?);
    }
    if let Some(path) = config {
        let text = settings::text(&path)?;
        let (source, mut table) = settings::of_file(&path, text).map_err(value_error)?;
        // The learner's settings do not concern an environment.
        let of_env = |key: &str| key == "env" || key == "setup";
        if let Some(key) = table.keys().find(|key| !of_env(key) && !RUN_KEYS.contains(&key.as_str())) {
            let words = "no key of a run's config.toml; known are env, setup";
            return Err(value_error(format!("{}: {key:?} is {words}, {}", path.display(), RUN_KEYS.join(", "))));
        }
        table.retain(|key, _| of_env(key));
        layers.push((source, table));
    }
    layers.push(layer(SOURCE, keywords)?);
    let config = settings::env(base, layers).map_err(|error| match unknown {
        // An unknown key of a task's `defaults` is not a keyword, so that Python's words would be wrong.
        Some(words) if words.is_empty() => type_error(error),
        Some(words) => type_error(format!("{words}{error:#} (Python's own: {})", PYTHONS_OWN.join(", "))),
        None => value_error(error),
    })?;
    if config.task != wanted {
        let (there, here) = (config.task.as_str(), wanted.as_str());
        return Err(value_error(format!(
            "env.task = {there:?} contradicts the environment's name, which says {here:?}"
        )));
    }
    Ok(config)
}

/// A dictionary as a table of settings. A key whose value is None counts as not given.
pub fn table(dict: &Bound<'_, PyDict>, depth: usize) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, value) in dict.iter() {
        table.extend(entry(named(&key)?, &value, depth + 1)?);
    }
    Ok(table)
}

fn named(key: &Bound<'_, PyAny>) -> PyResult<String> {
    key.extract().map_err(|_| PyTypeError::new_err(format!("{key}: a setting's name is a string")))
}

fn entry(key: String, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<Option<(String, Value)>> {
    if value.is_none() {
        return Ok(None);
    }
    let given = setting(&key, value, depth)?;
    // Nor is anything given by a dictionary whose values are all None.
    let is_nothing = given.as_table().is_some_and(Table::is_empty) && value.len()? > 0;
    Ok((!is_nothing).then_some((key, given)))
}

fn setting(key: &str, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    if depth > DEEPEST {
        return Err(value_error(format!("{key} lies {DEEPEST} settings deep: is a dict or a list part of itself?")));
    }
    if value.is_instance_of::<PyBool>() {
        return Ok(Value::Boolean(value.extract()?));
    }
    if value.is_instance_of::<PyString>() {
        return Ok(Value::String(value.extract()?));
    }
    if value.is_instance_of::<PyInt>() {
        let too_large = || value_error(format!("{key} = {value} is too large"));
        return Ok(Value::Integer(value.extract().map_err(|_| too_large())?));
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(Value::Float(value.extract()?));
    }
    if let Ok(dict) = value.cast::<PyDict>() {
        return Ok(Value::Table(table(dict, depth)?));
    }
    if let Ok(mapping) = value.cast::<PyMapping>() {
        let dict = PyDict::new(value.py());
        dict.update(mapping)?;
        return Ok(Value::Table(table(&dict, depth)?));
    }
    let is_bytes = value.is_instance_of::<PyBytes>() || value.is_instance_of::<PyByteArray>();
    if value.cast::<PySequence>().is_ok() && !is_bytes || value.hasattr("tolist")? {
        // numpy's arrays and numbers become Python's.
        let plain = if value.hasattr("tolist")? { value.call_method0("tolist")? } else { value.clone() };
        let Ok(items) = plain.try_iter() else { return setting(key, &plain, depth + 1) };
        return items.map(|item| setting(key, &item?, depth + 1)).collect::<PyResult<_>>().map(Value::Array);
    }
    if let Ok(path) = value.extract::<PathBuf>() {
        return Ok(Value::String(path.to_string_lossy().into_owned()));
    }
    let kind = value.get_type().name()?;
    Err(PyTypeError::new_err(format!("{key} is a {kind}: a setting is a number, a string, a list or a dict")))
}
