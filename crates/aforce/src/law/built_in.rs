//! Action spaces by name and from tables: the built-in spaces, and tables that extend them.

#![cfg_attr(
    not(test),
    expect(
        clippy::expect_used,
        reason = "the built-in file is read before the control loop, and a test reads all of it"
    )
)]

use std::str::FromStr;

use toml::{Table, Value};

use crate::law::action_space::ActionSpace;
use crate::record::{self, Problem};

/// The built-in records.
const FILE: &str = include_str!("../../spaces.toml");
/// Suffix of a name: the same space with a commanded force.
const FORCE: &str = "-force";

/// A name that is not that of a built-in action space.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown action space `{name}`; did you mean `{nearest}`? Known: {}, each also with -force", base_names().join(", "))]
pub struct UnknownActionSpace {
    /// The name given.
    pub name: String,
    /// The known name nearest to it.
    pub nearest: String,
}

/// Why a table is not an action space.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The table extends an unknown space.
    #[error(transparent)]
    Extends(#[from] UnknownActionSpace),
    /// `extends` is not a name.
    #[error("extends = {0}: must be the name of a built-in action space")]
    NotAName(Value),
    /// A field is missing, unknown or of the wrong type.
    #[error(transparent)]
    Field(#[from] Problem),
}

impl ActionSpace {
    /// Names of the built-in spaces: first those without force, then those with force.
    #[must_use]
    pub fn names() -> Vec<String> {
        let base = base_names();
        let force = base.iter().map(|name| format!("{name}{FORCE}"));
        base.iter().cloned().chain(force).collect()
    }

    /// Every built-in space, as [`names`](Self::names).
    ///
    /// # Panics
    /// Never: the built-in records are valid, which a test asserts.
    #[must_use]
    pub fn built_in() -> Vec<Self> {
        Self::names().iter().map(|name| name.parse().expect("a built-in record")).collect()
    }

    /// A space from a table: a whole record, or the changes to the built-in space that it `extends`. Without a `name` of its own the space
    /// is called `name`. Only names and types are checked: see [`validate`](Self::validate).
    ///
    /// # Errors
    /// If it extends an unknown space, or a field is missing, unknown or of the wrong type.
    pub fn from_table(table: Table, name: &str) -> Result<Self, RecordError> {
        Ok(record::read(complete(table, name)?)?)
    }
}

impl FromStr for ActionSpace {
    type Err = UnknownActionSpace;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Ok(built_in_table(name)?.try_into().expect("a built-in record"))
    }
}

/// `table` with a name, and with its key `extends` resolved.
fn complete(mut table: Table, name: &str) -> Result<Table, RecordError> {
    table.entry("name").or_insert_with(|| name.into());
    record::extended(table, |base| match base {
        Value::String(base) => Ok(built_in_table(&base)?),
        other => Err(RecordError::NotAName(other)),
    })
}

fn file() -> Table {
    FILE.parse().expect("the built-in file is TOML")
}

fn base_names() -> Vec<String> {
    file().keys().cloned().collect()
}

fn built_in_table(name: &str) -> Result<Table, UnknownActionSpace> {
    let base = name.strip_suffix(FORCE).unwrap_or(name);
    let Some(Value::Table(table)) = file().remove(base) else {
        let nearest = ActionSpace::names().into_iter().min_by_key(|known| strsim::levenshtein(name, known));
        return Err(UnknownActionSpace { name: name.to_owned(), nearest: nearest.expect("there are action spaces") });
    };
    let mut record = complete(table, name).expect("a built-in space extends a built-in space");
    if base != name {
        record.insert("force".into(), Value::Boolean(true));
    }
    Ok(record)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::goal::GoalRule;
    use crate::law::stiffness::{Stiffness, StiffnessUnit};

    fn space(name: &str) -> ActionSpace {
        name.parse().unwrap()
    }

    #[test]
    fn every_built_in_space_is_valid_and_survives_a_file() {
        for name in ActionSpace::names() {
            let space = space(&name);
            space.validate(500).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!((space.name.as_str(), space.force), (name.as_str(), name.ends_with(FORCE)));
            let text = toml::to_string(&space).unwrap();
            assert_eq!(toml::from_str::<ActionSpace>(&text).unwrap(), space, "{text}");
        }
    }

    #[test]
    fn a_wrong_name_is_answered_with_the_nearest_and_all() {
        let error = "varable-forse".parse::<ActionSpace>().unwrap_err();
        assert_eq!(error.nearest, "variable-force");
        let message = error.to_string();
        assert!(
            message.contains("`varable-forse`") && message.contains("aforce, aforce-psi, aforce-shaped"),
            "{message}"
        );
    }

    /// The paper's spaces differ in where the stiffness comes from, and in nothing else.
    #[test]
    fn compared_spaces_differ_in_the_rules_they_name() {
        let aforce = space("aforce");
        for name in ["low", "mid", "high"] {
            let other = space(name);
            assert_eq!(ActionSpace { stiffness: aforce.stiffness, name: "aforce".into(), ..other }, aforce);
        }
        let (variable, osc) = (space("variable"), space("osc"));
        assert_eq!(variable.unit, StiffnessUnit::PerSecondSquared);
        assert_eq!(ActionSpace { stiffness: variable.stiffness, name: "variable".into(), ..osc }, variable);
        assert_eq!(space("robosuite-osc").goal, GoalRule::Robosuite);
    }

    #[test]
    fn a_space_of_ones_own_is_a_few_lines() {
        let own = |text: &str| ActionSpace::from_table(text.parse().unwrap(), "own");
        let soft = own("extends = 'osc-force'\nstiffness.fixed = 45").unwrap();
        assert_eq!((soft.name.as_str(), soft.force), ("own", true));
        assert_eq!(soft.stiffness, Stiffness::Fixed(crate::law::gains::Gains::all(45.0)));
        let named = own("name = 'mine'\nextends = 'aforce'\nstiffness.adaptive.k_min = [150, 10]").unwrap();
        let (Stiffness::Adaptive(psi), Stiffness::Adaptive(theirs)) = (named.stiffness, space("aforce").stiffness)
        else {
            panic!("both adapt")
        };
        assert_eq!((named.name.as_str(), psi.k_min[0], psi.k_min[3]), ("mine", 150.0, 10.0));
        assert_eq!(psi.alpha, theirs.alpha);
        for (text, word) in [
            ("extends = 'aforze'", "did you mean `aforce`"),
            ("extends = 3", "extends = 3"),
            ("goal = 'rebased'", "missing field"),
            ("extends = 'aforce'\nstifness.fixed = 1", "stifness"),
            ("extends = 'aforce'\ngoal = { rebased = { leash_position = 1 } }", "goal"),
            ("extends = 'aforce'\nstiffness = { fixed = 1, adaptive = {} }", "stiffness"),
            ("extends = 'aforce'\nstiffness.adaptive.beta = [1, 2, 3]", "six numbers"),
            ("extends = 'aforce'\nunit = 'N/mm'", "N/m"),
        ] {
            let error = own(text).unwrap_err().to_string();
            assert!(error.contains(word), "{text}: {error}");
        }
    }
}
