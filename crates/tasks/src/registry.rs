//! The registered tasks by name, and the defaults and checks of settings that depend on them.

use std::str::FromStr;
use std::sync::RwLock;

use aforce::record::nearest;
use aforce::{ConfigError, name};

use crate::disturbance::{Disturbance, OwnDisturbance, is_known, is_of_some_tasks};
use crate::env_config::EnvConfig;
use crate::task::Task;
use crate::task_kind::TaskKind;
use crate::task_name::TaskName;
use crate::{door, insert, lift, wipe};

/// The tasks of this crate, in the order of [`TaskName::BUILT_IN`].
static BUILT_IN: [TaskKind; TaskName::BUILT_IN.len()] = [lift::KIND, door::KIND, wipe::KIND, insert::KIND];

/// The tasks that are not built in, in one list for the whole program: a name is parsed while a file is read, where no
/// caller could pass a list.
static OWN: RwLock<Own> = RwLock::new(Own { kinds: vec![], names: vec![] });

/// The tasks that are not built in.
struct Own {
    /// Every registration, also one that a later one replaced, because an environment may still use it. None is ever freed.
    kinds: Vec<&'static TaskKind>,
    /// The registrations that are valid now, in the order in which they were made.
    names: Vec<TaskName>,
}

impl Own {
    /// Registers `kind`.
    fn push(&mut self, kind: TaskKind) -> TaskName {
        let name = TaskName::new(kind.name, BUILT_IN.len() + self.kinds.len());
        self.kinds.push(Box::leak(Box::new(kind)));
        self.names.push(name);
        name
    }

    fn kind(&self, name: TaskName) -> &'static TaskKind {
        BUILT_IN.get(name.id()).unwrap_or_else(|| self.kinds[name.id() - BUILT_IN.len()])
    }

    /// All tasks: the built-in ones, then the others in the order of their registration.
    fn all(&self) -> impl Iterator<Item = TaskName> {
        TaskName::BUILT_IN.into_iter().chain(self.names.iter().copied())
    }
}

/// Registers tasks, so that settings, files, flags and programs know them by name. To be called once, before any of these is read.
///
/// # Errors
/// If a name is taken, or cannot be the name of a folder. If a disturbance is unknown, occurs twice, has the key of a
/// built-in one, or allows a value that no body or joint can have. No task is registered then.
pub fn register(kinds: &[TaskKind]) -> Result<(), ConfigError> {
    let mut own = OWN.write().expect("no writer panics");
    let mut taken: Vec<&str> = own.all().map(TaskName::as_str).collect();
    for kind in kinds {
        check_kind(kind)?;
        if taken.contains(&kind.name) {
            return Err(wrong(kind, "the name is registered twice, or is that of a built-in task"));
        }
        taken.push(kind.name);
    }
    for kind in kinds {
        own.push(*kind);
    }
    Ok(())
}

/// Registers a task that is [made elsewhere](TaskKind::made_elsewhere) and may be redefined while the program runs.
/// It replaces the registered task of its name. If the two differ in nothing but their defaults, the old one stays,
/// with the old defaults.
///
/// # Errors
/// As [`register`], except that the name may be one that this function has registered.
pub fn register_anew(kind: TaskKind) -> Result<TaskName, ConfigError> {
    check_kind(&kind)?;
    let mut own = OWN.write().expect("no writer panics");
    if own.all().any(|other| other.as_str() == kind.name && !own.kind(other).is_made_elsewhere()) {
        return Err(wrong(
            &kind,
            "the name is that of a task in Rust; choose another one (in Python the attribute `name`)",
        ));
    }
    if let Some(&same) = own.names.iter().find(|other| own.kind(**other).is_like(&kind)) {
        return Ok(same);
    }
    own.names.retain(|other| other.as_str() != kind.name);
    Ok(own.push(kind))
}

/// The error for a task that cannot be registered.
fn wrong(kind: &TaskKind, reason: impl Into<String>) -> ConfigError {
    ConfigError::Contradiction { field: format!("task {:?}", kind.name), reason: reason.into() }
}

/// Checks a task before it is registered. Its name can be that of a folder. The built-in disturbances that it names
/// exist. Its own disturbances have keys of their own, and values that a body or joint can have.
fn check_kind(kind: &TaskKind) -> Result<(), ConfigError> {
    let fits = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let wrong = |reason: String| Err(wrong(kind, reason));
    if !kind.name.chars().all(fits) {
        return wrong("a name has lower-case letters, digits and -".into());
    }
    name::check(kind.name).or_else(wrong)?;
    if let Some(key) = kind.disturbances.iter().find(|key| !is_of_some_tasks(key)) {
        return wrong(format!("{key:?} is no disturbance that only some tasks have"));
    }
    for OwnDisturbance { key, change, allowed } in kind.own_disturbances {
        if is_known(key) {
            return wrong(format!("its disturbance {key:?} has the key of one that is built in"));
        }
        if allowed[0] > allowed[1] || !allowed.iter().all(|&end| change.is_possible(end)) {
            let wanted = "wanted are two finite ends, the lower first; a mass above 0, nothing negative";
            return wrong(format!("its disturbance {key:?} allows {allowed:?}; {wanted}"));
        }
    }
    let mut keys: Vec<&str> = kind.own_disturbances.iter().map(|own| own.key).collect();
    keys.sort_unstable();
    match keys.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(twice) => wrong(format!("two of its disturbances are called {:?}", twice[0])),
        None => Ok(()),
    }
}

impl TaskName {
    /// All tasks: the built-in ones, then the others in the order of their registration.
    pub fn all() -> Vec<TaskName> {
        OWN.read().expect("no writer panics").all().collect()
    }

    /// What the task asks for: a verb and its object.
    pub fn purpose(self) -> &'static str {
        self.kind().purpose
    }

    /// What is registered under the name.
    pub(crate) fn kind(self) -> &'static TaskKind {
        OWN.read().expect("no writer panics").kind(self)
    }
}

impl FromStr for TaskName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let all = TaskName::all();
        all.iter().copied().find(|task| task.as_str() == text).ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|task| task.as_str()).collect();
            let hint = match nearest(text, &names) {
                Some(name) => format!("did you mean {name:?}?"),
                None => format!(
                    "known are {}; a task of one's own is known to the program that registers it",
                    names.join(", ")
                ),
            };
            format!("no task is called {text:?}; {hint}")
        })
    }
}

impl Disturbance {
    /// Checks every value, and that `task` has what is disturbed.
    ///
    /// # Errors
    /// The first value that is not allowed, with its key.
    pub fn validate(&self, task: TaskName) -> Result<(), ConfigError> {
        let TaskKind { disturbances, own_disturbances, .. } = task.kind();
        self.check(task.as_str(), disturbances, own_disturbances, |key| {
            let owners = TaskName::all().into_iter().filter(|task| task.kind().disturbances.contains(&key));
            owners.map(TaskName::as_str).collect()
        })
    }
}

impl EnvConfig {
    /// The default settings of a task: the general ones, overlaid by those that the task is registered with.
    pub fn of(task: TaskName) -> Self {
        let mut config = EnvConfig { task, ..EnvConfig::default() };
        task.kind().apply_defaults(&mut config);
        EnvConfig { task, ..config } // The task's defaults must not change the task.
    }

    /// The task, with its options.
    ///
    /// # Errors
    /// If an option is unknown or not allowed. If the task is [made elsewhere](TaskKind::made_elsewhere), or has
    /// another name than the one that it is registered with.
    pub fn create_task(&self) -> Result<Box<dyn Task>, ConfigError> {
        self.task.kind().create(self)
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is not allowed, with its field and range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        // First the values that the task's own check relies on, such as the robot, whose reach Insert works out.
        self.check()?;
        self.task.kind().check(self)?;
        self.disturbance.validate(self.task).map_err(|error| error.below("env"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Change, EnvConfig};

    #[test]
    fn a_task_goes_by_its_name() {
        for name in TaskName::BUILT_IN {
            let config = EnvConfig { task: name, ..EnvConfig::default() };
            assert_eq!(config.create_task().unwrap().name(), name.as_str());
            assert_eq!(name.as_str().parse(), Ok(name));
        }
        let error = "walk".parse::<TaskName>().unwrap_err();
        assert!(error.starts_with("no task is called \"walk\"; known are lift, door, wipe, insert"), "{error}");
        assert_eq!("dor".parse::<TaskName>().unwrap_err(), "no task is called \"dor\"; did you mean \"door\"?");
    }

    #[test]
    fn a_name_is_registered_once_and_fits_a_folder() {
        let kind = |name| TaskKind::new(name, "do nothing", |_| unreachable!("never made"));
        let error = |names: &[&'static str]| {
            let kinds: Vec<TaskKind> = names.iter().map(|name| kind(name)).collect();
            register(&kinds).unwrap_err().to_string()
        };
        assert_eq!(error(&["lift"]), "task \"lift\": the name is registered twice, or is that of a built-in task");
        for names in [&["press", "press"] as &[_], &["press", "door"]] {
            assert!(error(names).contains("registered twice"));
        }
        let long: &'static str = "n".repeat(300).leak();
        for (name, reason) in [
            ("My Task", "lower-case letters"),
            ("a/b", "lower-case letters"),
            ("", "is no name"),
            ("-x", "letter or digit first"),
            ("15", "reads as a number"),
            (long, "is too long"),
        ] {
            assert!(error(&[name]).contains(reason), "{name}");
        }
        let misspelt = kind("press").disturbed_by(&["cube_mas"]);
        assert!(register(&[misspelt]).unwrap_err().to_string().contains("\"cube_mas\" is no disturbance"));
        let own = |key, change, allowed| {
            let own: &'static [OwnDisturbance] = vec![OwnDisturbance { key, change, allowed }].leak();
            register(&[kind("press").own_disturbances(own)]).unwrap_err().to_string()
        };
        let mass = Change::BodyMass("block");
        assert!(own("friction", mass, [0.5, 2.0]).contains("\"friction\" has the key of one that is built in"));
        for (change, allowed) in [
            (mass, [0.0, 2.0]),
            (mass, [2.0, 0.5]),
            (mass, [0.5, f64::INFINITY]),
            (Change::JointDamping("slide"), [-0.1, 2.0]),
        ] {
            assert!(own("mine", change, allowed).contains("\"mine\" allows"), "{change:?} {allowed:?}");
        }
        assert_eq!(TaskName::all(), TaskName::BUILT_IN, "what is refused leaves nothing behind");
    }
}
