//! Lengths of observations and actions.

/// Lengths of observations and actions.
///
/// An observation in a [`Transition`](crate::Transition) and in the replay memory is `[what the actor sees | what only the critics
/// see]`; [`Sac::act`](crate::Sac::act) is given the actor's part alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    /// Numbers that the actor sees.
    pub observation: usize,
    /// Numbers that only the critics see; 0 in textbook SAC.
    pub privileged: usize,
    /// Numbers in an action.
    pub action: usize,
}

impl Sizes {
    /// Numbers that the critics see: an observation as the replay memory keeps it.
    #[must_use]
    pub fn whole_observation(self) -> usize {
        self.observation + self.privileged
    }
}

impl From<(usize, usize)> for Sizes {
    /// (observation, action): the critics see what the actor sees.
    fn from((observation, action): (usize, usize)) -> Self {
        Self { observation, privileged: 0, action }
    }
}
