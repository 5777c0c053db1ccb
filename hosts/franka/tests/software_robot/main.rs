//! `franka-host` over the real protocol, against a robot in software that enforces Franka's limits. Where that cannot be
//! installed (no Python, no package index) these tests say so and pass, or fail if REQUIRE_SOFTWARE_ROBOT is set.

mod harness;
mod motions;
mod policies;
mod refusals;
