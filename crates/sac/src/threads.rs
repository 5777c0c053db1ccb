//! The number of threads libtorch multiplies matrices with.

use std::sync::Once;

static CHOSEN: Once = Once::new();

/// One. With another busy process beside it, waiting threads slow an update from 9 ms to 300: use one process per seed
/// instead.
pub(crate) fn use_one() {
    CHOSEN.call_once(|| {
        tch::set_num_interop_threads(1);
        tch::set_num_threads(1);
    });
}
