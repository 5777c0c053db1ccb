//! The actions after which the task stands fulfilled.

use super::{Cell, Column};

pub(super) const COLUMNS: &[Column] = &[
    Column::new("fulfilled_time_s", "s", "time of the actions after which the task stands fulfilled", |e| {
        Cell::Real(e.fulfilled.time)
    }),
    Column::new("fulfilled_energy_j", "J", "their energy", |e| Cell::Real(e.fulfilled.energy)),
    Column::new("fulfilled_max_force_n", "N", "their largest sustained force on the whole arm", |e| {
        Cell::Real(e.fulfilled.max_force)
    }),
    Column::new("fulfilled_impulse_ns", "N s", "the integral of that force", |e| Cell::Real(e.fulfilled.impulse)),
];
