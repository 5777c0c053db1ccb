//! How a policy may act: an action space is data, not a type.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::config::ControllerConfig;

/// Where the stiffness comes from, and whether the policy also commands a force.
///
/// An action lies in [-1, 1] and reads `[kp (6) if commanded] [delta position (3), delta rotation (3)]
/// [normal force (1) if force]`; [`ActionSpace::entries`] describes each entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct ActionSpace {
    /// Where the stiffness comes from.
    pub impedance: Impedance,
    /// The policy commands a force along the contact axis.
    pub force: bool,
}

/// Where the stiffness comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Impedance {
    /// From the tracking error, by the paper's law: `aforce`.
    Adaptive,
    /// From the policy: `variable`, robosuite's `variable_kp`.
    Commanded,
    /// From the configuration, and constant.
    Fixed(Level),
}

/// The fixed impedances.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Level {
    /// Soft.
    Low,
    /// In between.
    Mid,
    /// Stiff.
    High,
    /// robosuite's default operational-space controller, kp 150, with this workbench's ramp (robosuite's set-point jumps).
    Osc,
}

/// One entry of an action.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActionEntry {
    /// Name of the entry.
    pub name: &'static str,
    /// Unit of `low` and `high`.
    pub unit: &'static str,
    /// Axes in which the entry is expressed.
    pub frame: &'static str,
    /// What -1 means.
    pub low: f64,
    /// What +1 means.
    pub high: f64,
}

/// The impedances without and with force, each with its name.
pub(crate) const NAMED: [(Impedance, &str, &str); 6] = [
    (Impedance::Adaptive, "aforce", "aforce-force"),
    (Impedance::Commanded, "variable", "variable-force"),
    (Impedance::Fixed(Level::Low), "low", "low-force"),
    (Impedance::Fixed(Level::Mid), "mid", "mid-force"),
    (Impedance::Fixed(Level::High), "high", "high-force"),
    (Impedance::Fixed(Level::Osc), "osc", "osc-force"),
];

impl ActionSpace {
    /// Every action space.
    pub const ALL: [Self; 2 * NAMED.len()] = {
        let mut all = [Self { impedance: Impedance::Adaptive, force: false }; 2 * NAMED.len()];
        let mut i = 0;
        while i < all.len() {
            all[i] = Self { impedance: NAMED[i % NAMED.len()].0, force: i >= NAMED.len() };
            i += 1;
        }
        all
    };

    /// Length of an action.
    #[must_use]
    pub fn dim(&self) -> usize {
        let commanded = if self.impedance == Impedance::Commanded { 6 } else { 0 };
        commanded + 6 + usize::from(self.force)
    }

    /// The name, as in configuration files.
    #[must_use]
    pub fn name(&self) -> &'static str {
        let (_, plain, force) =
            NAMED.iter().find(|(impedance, ..)| *impedance == self.impedance).expect("every impedance is named");
        if self.force { force } else { plain }
    }

    /// What each entry of an action means under `config`, in order.
    #[must_use]
    pub fn entries(&self, config: &ControllerConfig) -> Vec<ActionEntry> {
        const STIFFNESS: [&str; 6] = ["kp_x", "kp_y", "kp_z", "kp_rx", "kp_ry", "kp_rz"];
        const DELTA: [&str; 6] = ["delta_x", "delta_y", "delta_z", "delta_rx", "delta_ry", "delta_rz"];
        const WORLD: &str = "world axes, at the tool point";
        let mut entries = Vec::with_capacity(self.dim());
        if self.impedance == Impedance::Commanded {
            let variable = &config.impedance.variable;
            for (axis, name) in STIFFNESS.into_iter().enumerate() {
                let [low, high] = variable.range(axis);
                let unit = variable.form.convention.stiffness_unit(axis);
                entries.push(ActionEntry { name, unit, frame: WORLD, low, high });
            }
        }
        for (axis, name) in DELTA.into_iter().enumerate() {
            let (unit, step) = (if axis < 3 { "m" } else { "rad" }, config.step(axis));
            entries.push(ActionEntry { name, unit, frame: WORLD, low: -step, high: step });
        }
        if self.force {
            let frame = "along the task's contact axis, environment on tool";
            entries.push(ActionEntry {
                name: "normal_force",
                unit: "N",
                frame,
                low: 0.0,
                high: config.force.force_max,
            });
        }
        entries
    }
}

impl fmt::Display for ActionSpace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is no action space.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown action space `{name}`; did you mean `{nearest}`? Known: {}", ActionSpace::ALL.map(|s| s.name()).join(", "))]
pub struct UnknownActionSpace {
    /// The name given.
    pub name: String,
    /// The known name nearest to it.
    pub nearest: &'static str,
}

impl FromStr for ActionSpace {
    type Err = UnknownActionSpace;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|space| space.name() == name).ok_or_else(|| {
            let nearest = Self::ALL.iter().map(Self::name).min_by_key(|known| edit_distance(name, known));
            UnknownActionSpace { name: name.to_owned(), nearest: nearest.expect("there are action spaces") }
        })
    }
}

impl TryFrom<String> for ActionSpace {
    type Error = UnknownActionSpace;

    fn try_from(name: String) -> Result<Self, Self::Error> {
        name.parse()
    }
}

impl From<ActionSpace> for String {
    fn from(space: ActionSpace) -> Self {
        space.name().to_owned()
    }
}

/// Insertions, deletions and substitutions between two names (Levenshtein).
fn edit_distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.chars().enumerate() {
            let substituted = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.chars().count()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip_through_text_and_serde() {
        #[derive(Serialize, Deserialize)]
        struct File {
            space: ActionSpace,
        }
        for space in ActionSpace::ALL {
            assert_eq!(space.to_string().parse(), Ok(space));
            let text = toml::to_string(&File { space }).unwrap();
            assert_eq!(text.trim(), format!("space = \"{space}\""));
            assert_eq!(toml::from_str::<File>(&text).unwrap().space, space);
        }
        let names: std::collections::HashSet<_> = ActionSpace::ALL.iter().map(ActionSpace::name).collect();
        assert_eq!(names.len(), 2 * NAMED.len());
    }

    #[test]
    fn a_wrong_name_is_answered_with_the_nearest_and_all() {
        let error = "varable-forse".parse::<ActionSpace>().unwrap_err();
        assert_eq!(error.nearest, "variable-force");
        let message = error.to_string();
        assert!(
            message.contains("`varable-forse`")
                && message.contains("aforce, variable, low, mid, high, osc, aforce-force")
        );
    }

    #[test]
    fn dimensions_and_entries_agree() {
        let config = crate::testing::robosuite_steps();
        let dims = [6, 12, 6, 6, 6, 6, 7, 13, 7, 7, 7, 7];
        assert_eq!(dims.len(), ActionSpace::ALL.len());
        for (space, dim) in ActionSpace::ALL.into_iter().zip(dims) {
            assert_eq!(space.dim(), dim, "{space}");
            assert_eq!(space.entries(&config).len(), dim, "{space}");
        }
        let described = "variable-force".parse::<ActionSpace>().unwrap().entries(&config);
        assert_eq!(
            (described[0].name, described[0].unit, described[0].low, described[0].high),
            ("kp_x", "1/s^2", 0.0, 300.0)
        );
        assert_eq!((described[6].name, described[6].unit, described[6].low), ("delta_x", "m", -0.05));
        assert_eq!((described[12].name, described[12].unit, described[12].high), ("normal_force", "N", 50.0));
    }
}
