//! The name of a registered task.

use std::fmt::{self, Debug, Formatter};

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A registered task, by its name.
#[derive(Clone, Copy)]
pub struct TaskName {
    name: &'static str,
    /// Which registration: a task that was [registered anew](crate::register_anew) keeps its name.
    id: usize,
}

impl TaskName {
    /// Lift a cube off a table.
    pub const LIFT: TaskName = TaskName::new("lift", 0);
    /// Turn a handle and pull a door open.
    pub const DOOR: TaskName = TaskName::new("door", 1);
    /// Wipe a line of markers off a table, pressing neither too little nor too hard.
    pub const WIPE: TaskName = TaskName::new("wipe", 2);
    /// Put a peg into a hole.
    pub const INSERT: TaskName = TaskName::new("insert", 3);
    /// robosuite's tasks, which are the paper's.
    pub const ROBOSUITE: [TaskName; 3] = [TaskName::LIFT, TaskName::DOOR, TaskName::WIPE];
    /// The tasks of this crate.
    pub const BUILT_IN: [TaskName; 4] = [TaskName::LIFT, TaskName::DOOR, TaskName::WIPE, TaskName::INSERT];

    /// The name of registration `id`.
    pub(crate) const fn new(name: &'static str, id: usize) -> Self {
        TaskName { name, id }
    }

    /// The name used on command lines, in files and in folders.
    pub const fn as_str(self) -> &'static str {
        self.name
    }

    /// Number of the registration.
    pub(crate) fn id(self) -> usize {
        self.id
    }
}

/// Lift.
impl Default for TaskName {
    fn default() -> Self {
        TaskName::LIFT
    }
}

impl PartialEq for TaskName {
    fn eq(&self, other: &Self) -> bool {
        self.as_str() == other.as_str()
    }
}

impl Eq for TaskName {}

impl Debug for TaskName {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl Serialize for TaskName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for TaskName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Name;
        impl Visitor<'_> for Name {
            type Value = TaskName;

            fn expecting(&self, f: &mut Formatter<'_>) -> fmt::Result {
                f.write_str("a name in quotes")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<TaskName, E> {
                text.parse().map_err(E::custom)
            }
        }
        deserializer.deserialize_str(Name)
    }
}
