//! The number of threads libtorch multiplies matrices with.

use std::sync::Once;

static CHOSEN: Once = Once::new();

/// Sets the number of threads of libtorch for this process; call it before the first learner is made. Without it there is one.
///
/// One is right almost always: with another busy process beside it, waiting threads slow an update from 9 ms to 300. Use one process
/// per seed instead.
pub fn init_threads(n: usize) {
    CHOSEN.call_once(|| tch::set_num_interop_threads(1));
    tch::set_num_threads(i32::try_from(n.max(1)).unwrap_or(i32::MAX));
}

/// One thread, unless [`init_threads`] was called.
pub(crate) fn default_to_one() {
    CHOSEN.call_once(|| {
        tch::set_num_interop_threads(1);
        tch::set_num_threads(1);
    });
}
