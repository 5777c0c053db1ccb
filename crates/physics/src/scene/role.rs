//! What a geom belongs to, which decides what it collides with.

use serde::{Deserialize, Serialize};

/// What a geom belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Floor, table, mount, the arm's base.
    Fixture,
    /// A link of the arm, 1 to 7.
    Link(u8),
    /// Hand and finger shells, beyond the wrist.
    Hand,
    /// A finger pad, beyond the wrist.
    Pad,
    /// What is manipulated.
    Object,
    /// A tool without joints, beyond the wrist.
    Tool,
}

impl Role {
    /// Whether contacts of this geom belong to the wrench beyond the wrist.
    pub fn is_beyond_wrist(self) -> bool {
        matches!(self, Role::Hand | Role::Pad | Role::Tool)
    }

    /// Whether this is a part of the arm, hand and tool included.
    pub fn is_on_arm(self) -> bool {
        self.joints().is_some()
    }

    /// How many joints of the arm carry the geom; `None` for a geom that is not on the arm. Hand and tool are welded to link 7.
    fn joints(self) -> Option<u8> {
        match self {
            Role::Fixture | Role::Object => None,
            Role::Link(link) => Some(link),
            Role::Hand | Role::Pad | Role::Tool => Some(7),
        }
    }

    /// Whether geoms of the two roles can touch, given the pairs of parts that never do
    /// ([`crate::robots::Robot::never_touch`]).
    pub fn collides_with(self, other: Role, never_touch: &[[u8; 2]]) -> bool {
        if self == Role::Object || other == Role::Object {
            return true;
        }
        let [a, b] = [self, other].map(|role| role.joints().unwrap_or(0));
        a != b && !never_touch.contains(&[a, b]) && !never_touch.contains(&[b, a])
    }

    const ALL: [Role; 12] = {
        use Role::*;
        [Fixture, Link(1), Link(2), Link(3), Link(4), Link(5), Link(6), Link(7), Hand, Pad, Object, Tool]
    };

    /// This role's bit in a collision mask.
    ///
    /// # Panics
    /// For `Link(0)` and links beyond the seventh.
    pub fn bit(self) -> u32 {
        1 << Role::ALL.iter().position(|&r| r == self).expect("listed above")
    }

    /// The bits of all roles this one can touch; see [`collides_with`](Self::collides_with).
    pub fn mask(self, never_touch: &[[u8; 2]]) -> u32 {
        Role::ALL.iter().filter(|&&other| self.collides_with(other, never_touch)).map(|r| r.bit()).sum()
    }
}
