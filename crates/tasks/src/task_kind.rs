//! What a task is registered with: name, constructor, defaults, disturbances and options.

use std::fmt::{self, Debug, Formatter};

use aforce::ConfigError;

use crate::disturbance::OwnDisturbance;
use crate::env_config::EnvConfig;
use crate::task::Task;

/// Makes a task with the options of a configuration.
type Create = fn(&EnvConfig) -> Result<Box<dyn Task>, ConfigError>;

/// What a task is registered with. Built-in tasks and a user's own use the same calls.
///
/// ```
/// # use tasks::{EnvConfig, Task, TaskKind};
/// # fn create(_: &EnvConfig) -> Result<Box<dyn Task>, aforce::ConfigError> { unimplemented!() }
/// const DRAWER: TaskKind = TaskKind::new("drawer", "pull a drawer open", create).defaults(|env| env.horizon = 200);
/// ```
#[derive(Clone, Copy)]
pub struct TaskKind {
    pub(crate) name: &'static str,
    pub(crate) purpose: &'static str,
    /// `None`: the program that makes the environment makes the task too.
    create: Option<Create>,
    defaults: fn(&mut EnvConfig),
    pub(crate) disturbances: &'static [&'static str],
    pub(crate) own_disturbances: &'static [OwnDisturbance],
    takes_options: bool,
}

impl TaskKind {
    /// A task called `name`: lower-case letters, digits and `-`, as it stands on command lines and in names of folders.
    /// `purpose` is what the task asks for, a verb and its object. `create` makes the task; it reads the task's own options with
    /// [`EnvConfig::own_options`].
    pub const fn new(name: &'static str, purpose: &'static str, create: Create) -> Self {
        TaskKind {
            name,
            purpose,
            create: Some(create),
            defaults: |_| (),
            disturbances: &[],
            own_disturbances: &[],
            takes_options: false,
        }
    }

    /// A task that is made elsewhere and handed to [`Env::with_task`](crate::Env::with_task), such as one written in another language.
    pub const fn made_elsewhere(name: &'static str, purpose: &'static str) -> Self {
        TaskKind { create: None, ..TaskKind::new(name, purpose, |_| unreachable!()) }
    }

    /// With default settings that differ from those of other tasks, such as horizon, force limit or noise of the start. Files
    /// and flags override them.
    pub const fn defaults(self, defaults: fn(&mut EnvConfig)) -> Self {
        TaskKind { defaults, ..self }
    }

    /// With keys of [`Disturbance`](crate::Disturbance) that not every task has: `table_height_m`, `cube_mass` (of every body with a free joint),
    /// `hinge_damping` and `hinge_spring` (of a joint called `hinge`).
    pub const fn disturbed_by(self, disturbances: &'static [&'static str]) -> Self {
        TaskKind { disturbances, ..self }
    }

    /// With disturbances of the task's own bodies and joints, which stand below `env.disturbance.own`.
    pub const fn own_disturbances(self, own_disturbances: &'static [OwnDisturbance]) -> Self {
        TaskKind { own_disturbances, ..self }
    }

    /// With options of its own, which stand below `env.options`.
    pub const fn takes_options(self) -> Self {
        TaskKind { takes_options: true, ..self }
    }

    /// The task, with its options.
    pub(crate) fn create(&self, config: &EnvConfig) -> Result<Box<dyn Task>, ConfigError> {
        self.check_options(config)?;
        let Some(create) = self.create else {
            let reason = format!("{} is made by the program that plays it, and known there alone", self.name);
            return Err(ConfigError::Contradiction { field: "env.task".into(), reason });
        };
        let task = create(config)?;
        if task.name() != self.name {
            let reason = format!("registered as {:?}, it calls itself {:?}", self.name, task.name());
            return Err(ConfigError::Contradiction { field: "env.task".into(), reason });
        }
        Ok(task)
    }

    /// Whether the program that makes the environment makes the task too.
    pub(crate) fn is_made_elsewhere(&self) -> bool {
        self.create.is_none()
    }

    /// Whether both are made elsewhere and agree in all but their defaults.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let words =
            |kind: &Self| (kind.name, kind.purpose, kind.disturbances, kind.own_disturbances, kind.takes_options);
        self.is_made_elsewhere() && other.is_made_elsewhere() && words(self) == words(other)
    }

    /// Checks that the task can be made with its options.
    pub(crate) fn check(&self, config: &EnvConfig) -> Result<(), ConfigError> {
        match self.create {
            Some(_) => self.create(config).map(drop),
            None => self.check_options(config),
        }
    }

    fn check_options(&self, config: &EnvConfig) -> Result<(), ConfigError> {
        let Some(key) = config.options.keys().next().filter(|_| !self.takes_options) else { return Ok(()) };
        let reason = format!("{} has no options of its own", self.name);
        Err(ConfigError::Contradiction { field: format!("env.options.{key}"), reason })
    }

    /// Puts the task's own defaults into settings.
    pub(crate) fn apply_defaults(&self, config: &mut EnvConfig) {
        (self.defaults)(config);
    }
}

impl Debug for TaskKind {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.debug_struct("TaskKind").field("name", &self.name).finish_non_exhaustive()
    }
}
