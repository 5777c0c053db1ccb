//! How far an axis reaches, and what its ticks are called.

/// Smallest and largest value along an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    pub low: f64,
    pub high: f64,
}

impl Range {
    pub const EMPTY: Range = Range { low: f64::INFINITY, high: f64::NEG_INFINITY };

    pub fn include(&mut self, value: f64) {
        self.low = self.low.min(value);
        self.high = self.high.max(value);
    }

    fn size(&self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// The limits to draw: never empty, and wider than the data by a share of its extent at both ends.
    pub fn axis(self, margin: f64) -> Range {
        let extent = self.high - self.low;
        if self == Range::EMPTY {
            Range { low: 0.0, high: 1.0 }
        } else if extent <= 1e-9 * self.size() {
            let half = if self.size() > 0.0 { 0.1 * self.size() } else { 1.0 };
            Range { low: self.low - half, high: self.high + half }
        } else {
            Range { low: self.low - margin * extent, high: self.high + margin * extent }
        }
    }

    /// From logarithms back to values.
    pub fn powers_of_ten(self) -> Range {
        Range { low: 10f64.powf(self.low), high: 10f64.powf(self.high) }
    }

    /// "250k" rather than "250000", so that the labels of environment steps do not run into each other; no more decimals
    /// than the distance between two ticks needs.
    pub fn tick_label(&self, value: f64) -> String {
        let extent = self.high - self.low;
        if value != 0.0 && (self.size() >= 1e12 || self.size() < 1e-3) {
            return format!("{value:.2e}").replace('-', "−");
        }
        let (unit, suffix) = match value.abs() {
            // On such an axis the labels of neighbouring ticks would be the same in the units below.
            _ if self.size() < 1e4 || extent < 1e-2 * self.size() => (1.0, ""),
            size if size >= 1e9 => (1e9, "G"),
            size if size >= 1e6 => (1e6, "M"),
            size if size >= 1e3 => (1e3, "k"),
            _ => (1.0, ""),
        };
        let decimals = (2.0 - (extent / unit).log10()).ceil().clamp(0.0, 12.0) as usize;
        let number = format!("{:.decimals$}", value / unit).replace('-', "−");
        let number = if decimals > 0 { number.trim_end_matches('0').trim_end_matches('.') } else { &number };
        format!("{number}{suffix}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tick_labels_are_short_and_distinct() {
        let label = |low, high, value| Range { low, high }.tick_label(value);
        assert_eq!(label(0.0, 1e6, 250_000.0), "250k");
        assert_eq!(label(0.0, 2e6, 1.25e6), "1.25M");
        assert_eq!(label(-10.0, 450.0, -10.0), "−10");
        assert_eq!(label(0.0, 1.0, 0.1 + 0.2), "0.3");
        assert_eq!(label(0.0, 4e-3, 2.5e-3), "0.0025");
        assert_eq!(label(1e6, 1e6 + 0.1, 1e6 + 0.02), "1000000.02");
    }
}
