//! Colours: an action space has the same one in every figure and page.

/// Of the built-in spaces, and of those that the committed runs have. Most are Okabe and Ito's, which colour-blind readers can
/// tell apart; a space with force is of the kind of its space without.
const SPACES: [(&str, &str); 17] = [
    ("aforce", "#0072b2"),
    ("aforce-force", "#56b4e9"),
    ("variable", "#d55e00"),
    ("variable-force", "#e69f00"),
    ("osc", "#009e73"),
    ("osc-force", "#66c2a5"),
    ("low", "#cc79a7"),
    ("low-force", "#aa4499"),
    ("mid", "#b07aa1"),
    ("mid-force", "#8c6d8c"),
    ("high", "#8b4513"),
    ("high-force", "#c49c6b"),
    ("aforce-psi", "#332288"),
    ("aforce-psi-force", "#6a5acd"),
    ("aforce-shaped", "#4477aa"),
    ("robosuite-variable", "#aa3322"),
    ("robosuite-osc", "#117733"),
];

/// Of whatever is not an action space, in their order: dark enough for a line on white.
pub(crate) const OTHERS: [&str; 10] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8b4513", "#6a3d9a", "#808080"];

/// The colour of an action space by its name, in whichever case; `None` of one without a colour of its own.
pub fn of_space(name: &str) -> Option<&'static str> {
    SPACES.iter().find(|(space, _)| space.eq_ignore_ascii_case(name)).map(|(_, color)| *color)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_two_spaces_share_a_colour() {
        assert_eq!(SPACES.map(|space| space.1).into_iter().collect::<BTreeSet<_>>().len(), SPACES.len());
        assert_eq!((of_space("AFORCE"), of_space("aforce,n_step=5")), (Some("#0072b2"), None));
    }
}
