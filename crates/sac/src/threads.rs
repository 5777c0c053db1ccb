//! The number of threads libtorch multiplies matrices with.

use std::sync::Once;

static CHOSEN: Once = Once::new();

/// One. With another busy process beside it, threads that wait for each other slow an update some thirtyfold: use one
/// process per seed instead.
pub(crate) fn use_one() {
    CHOSEN.call_once(|| {
        tch::set_num_interop_threads(1);
        tch::set_num_threads(1);
    });
}
