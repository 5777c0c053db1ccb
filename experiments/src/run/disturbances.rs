//! A file with a grid of disturbances under which a policy is evaluated.

use std::path::Path;

use anyhow::Result;
use output::program::bad;
use serde::Deserialize;
use tasks::{Disturbance, TaskName};

/// A disturbance with a name.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Unique; what the table calls it.
    pub name: String,
    /// The only task that it is for; all if absent.
    #[serde(default)]
    pub task: Option<TaskName>,
    /// What is disturbed.
    pub disturbance: Disturbance,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Grid {
    case: Vec<Case>,
}

/// The table's name for the undisturbed episodes, with which the others are paired.
pub const UNDISTURBED: &str = "none";

/// The cases of `path` that are for `task`, after one without a disturbance.
///
/// # Errors
/// If the file is not a list of cases, two cases have the same name, or a case disturbs something that `task` does not have.
pub fn read(path: &Path, task: TaskName) -> Result<Vec<Case>> {
    let wrong = |problem: String| bad(format!("{}: {problem}", path.display()));
    let Grid { case: cases } = settings::parse(&settings::text(path)?).map_err(wrong)?;
    let none = Case { name: UNDISTURBED.into(), task: None, disturbance: Disturbance::default() };
    let mut read = vec![none];
    for case in cases.into_iter().filter(|case| case.task.is_none_or(|only| only == task)) {
        let name = &case.name;
        if name == UNDISTURBED {
            return Err(wrong(format!("{UNDISTURBED:?} is what undisturbed episodes are called")));
        }
        if read.iter().any(|other| other.name == *name) {
            return Err(wrong(format!("two cases are named {name:?}")));
        }
        // Tables round what reads as a number to seven digits.
        if name.parse::<f64>().is_ok() {
            return Err(wrong(format!("case {name:?}: a name that reads as a number")));
        }
        case.disturbance.validate(task).map_err(|problem| wrong(format!("case {name:?}: {problem:#}")))?;
        read.push(case);
    }
    Ok(read)
}
