//! The terms of a reward, each with its name.

/// The most terms a reward has.
const MOST: usize = 16;

/// The terms that add up to a reward, each a name and a value: `RewardTerms::from([("reach", 0.1), ("penalty", -0.2)])`.
///
/// More than sixteen do not compile. The array has a fixed size, so that an action allocates nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RewardTerms([Option<(&'static str, f64)>; MOST]);

impl<const N: usize> From<[(&'static str, f64); N]> for RewardTerms {
    fn from(terms: [(&'static str, f64); N]) -> Self {
        const { assert!(N <= MOST, "a reward has sixteen terms at most") };
        let mut places = [None; MOST];
        places.iter_mut().zip(terms).for_each(|(place, term)| *place = Some(term));
        RewardTerms(places)
    }
}

impl RewardTerms {
    /// Terms whose number is known only at run time; `None` if there are more than sixteen.
    pub fn of(terms: &[(&'static str, f64)]) -> Option<Self> {
        let mut places = [None; MOST];
        (terms.len() <= MOST).then(|| {
            places.iter_mut().zip(terms).for_each(|(place, term)| *place = Some(*term));
            RewardTerms(places)
        })
    }

    /// Name and value of each, in the task's order.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.0.into_iter().flatten()
    }

    /// Name of each, in the task's order.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.iter().map(|(name, _)| name)
    }

    /// The value of the term of this name.
    ///
    /// # Panics
    /// If there is none.
    pub fn value(&self, name: &str) -> f64 {
        let term = self.iter().find(|(known, _)| *known == name);
        term.unwrap_or_else(|| panic!("{name} is no term of {self:?}")).1
    }

    /// The sum of the terms.
    pub fn sum(&self) -> f64 {
        self.iter().map(|(_, value)| value).sum()
    }

    /// The first term that is no finite number.
    pub(crate) fn not_finite(&self) -> Option<(&'static str, f64)> {
        self.iter().find(|(_, value)| !value.is_finite())
    }

    /// The same names, each with 0.
    pub(crate) fn zeroed(self) -> Self {
        RewardTerms(self.0.map(|term| term.map(|(name, _)| (name, 0.0))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_terms_are_taken_and_no_more() {
        let terms = [("near", 0.25); MOST + 1];
        let all = RewardTerms::of(&terms[..MOST]).unwrap();
        assert_eq!((all.iter().count(), all.sum()), (MOST, 4.0));
        assert_eq!(RewardTerms::of(&terms[..1]), Some(RewardTerms::from([("near", 0.25)])));
        assert_eq!(RewardTerms::of(&terms), None);
    }
}
