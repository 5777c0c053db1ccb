//! One entry of an action.

/// An entry as it counts: clipped to [-1, 1]; one that is not a number is `otherwise`.
pub(crate) fn clip(entry: f64, otherwise: f64) -> f64 {
    if entry.is_nan() { otherwise } else { entry.clamp(-1.0, 1.0) }
}
