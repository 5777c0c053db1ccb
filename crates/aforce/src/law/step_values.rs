//! The plain values that pass from one step of the law to the next.

use crate::law::force::ForceAxis;
use crate::law::operational_space::OperationalSpace;
use crate::spatial::{Vector6, Wrench};

/// What a controller senses: the distance of the tool from its set-point, and the inertia that a wrench at the tool accelerates.
#[derive(Debug, Clone)]
pub struct Errors {
    /// e = x - x_d (m, rad; world axes).
    pub e: Vector6,
    /// e_dot (m/s, rad/s; world axes).
    pub e_dot: Vector6,
    /// What the torque limits cut off the last sample's torque, seen at the tool: J (tau wanted - tau sent). Only its signs
    /// mean something. Zero in a space whose stiffness does not adapt.
    pub excess: Vector6,
    /// The contact axis, with the share of it that force control owns.
    pub axis: ForceAxis,
    /// Lambda, the arm's inertia as felt at the tool.
    pub lambda: OperationalSpace,
    /// Time since the last sample (s).
    pub dt: f64,
}

/// What a controller adapts from the errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adapted {
    /// K in the space's unit.
    pub stiffness: Vector6,
    /// F_ff in the space's unit; zero in a space whose stiffness does not adapt.
    pub feedforward: Vector6,
    /// F_cmd, with which force control holds F_d (N, Nm; world axes); zero in a space without force.
    pub force: Wrench,
}
