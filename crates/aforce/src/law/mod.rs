//! The law: from an action and measurements to torques, in the order of the paper's equations.
//!
//! [`controller`] is the whole law, and its steps call the other modules: an action ([`action`], [`goal`]), the set-point
//! ([`interpolator`]), K and F_ff ([`adaptation`]), the contact force ([`force`]), the wrench ([`impedance`]), the posture
//! ([`null_space`]), the joints' limits ([`limits`]). An [`action_space`] is data. These modules do not use [`host`](crate::host), which
//! calls them.

pub(crate) mod action;
pub(crate) mod action_space;
pub(crate) mod adaptation;
pub(crate) mod arm_stability;
pub(crate) mod built_in;
pub(crate) mod commanded_psi;
pub(crate) mod config;
pub(crate) mod contact;
pub(crate) mod controller;
pub(crate) mod damping;
pub(crate) mod entry;
pub(crate) mod force;
pub(crate) mod gains;
pub(crate) mod goal;
pub(crate) mod impedance;
pub(crate) mod interpolator;
pub(crate) mod jerk_limited;
pub(crate) mod limits;
pub(crate) mod linear_ramp;
pub(crate) mod null_space;
pub(crate) mod operational_space;
pub(crate) mod psi;
pub(crate) mod stability;
pub(crate) mod step_values;
pub(crate) mod stiffness;
