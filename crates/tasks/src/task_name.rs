//! The tasks' names.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The tasks by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TaskName {
    /// Lift a cube off a table.
    #[default]
    Lift,
    /// Turn a handle and pull a door open.
    Door,
    /// Wipe a line of markers off a table, pressing neither too little nor too hard.
    Wipe,
}

impl TaskName {
    /// All tasks.
    pub const ALL: [TaskName; 3] = [TaskName::Lift, TaskName::Door, TaskName::Wipe];

    /// The name used on command lines, in files and in folders.
    pub fn as_str(self) -> &'static str {
        match self {
            TaskName::Lift => "lift",
            TaskName::Door => "door",
            TaskName::Wipe => "wipe",
        }
    }
}

impl FromStr for TaskName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = Self::ALL.map(Self::as_str).join(", ");
        let known = Self::ALL.into_iter().find(|task| task.as_str() == text);
        known.ok_or_else(|| format!("no task is called {text:?}; known are {names}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EnvConfig;

    #[test]
    fn a_task_goes_by_its_name() {
        for name in TaskName::ALL {
            let config = EnvConfig { task: name, ..EnvConfig::default() };
            assert_eq!(config.create_task().name(), name.as_str());
            assert_eq!(name.as_str().parse(), Ok(name));
        }
        let error = "walk".parse::<TaskName>().unwrap_err();
        let known = TaskName::ALL.map(TaskName::as_str).join(", ");
        assert_eq!(error, format!("no task is called \"walk\"; known are {known}"));
    }
}
