//! Playing what was trained; how an episode looks is the crate `show`'s.

pub mod source;
