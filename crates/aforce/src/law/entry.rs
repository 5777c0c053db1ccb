//! One entry of an action.

/// An entry of an action, clipped to [-1, 1]; `otherwise` if it is NaN.
pub(crate) fn clip(entry: f64, otherwise: f64) -> f64 {
    if entry.is_nan() { otherwise } else { entry.clamp(-1.0, 1.0) }
}
