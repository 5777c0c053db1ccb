//! Adaptive force-impedance control (AFORCE, arXiv 2110.09904) and the action spaces it is compared with.
//!
//! A slow policy says where to go and how hard to press; a fast law adapts stiffness K(t) and feed-forward wrench
//! F_ff(t) by itself. With e = x - x_d (actual minus desired):
//!
//! ```text
//! tau   = J^T ( -F_ff - F_d - K e - D e_dot )  + gravity and Coriolis + null space
//! K_dot = beta |eps| - gamma 1        (eq. 4)
//! F_ff_dot = alpha eps - mu F_ff      (eq. 5)
//! eps   = e + delta e_dot             (eq. 6; the paper prints e - delta e_dot, see [`DeltaSign`])
//! ```
//!
//! An [`ActionSpace`] is one record of data that says which of these a policy commands, and by which rules. In a space whose
//! stiffness is in 1/s^2, F_ff, K e and D e_dot are accelerations, which the arm's inertia Lambda turns into a wrench; e_dot is
//! x_dot alone in a space that damps against standstill ([`RateRule`]); in place of F_d stands the output of the force
//! controller that holds it ([`ForceConfig`]).
//!
//! Conventions, stated once and used everywhere: SI units; six-vectors are *linear first*, in world axes, at the tool
//! point; a [`Wrench`] in a [`Measurement`] is what the environment exerts *on the tool*, and F_d is the wrench the
//! environment *should* exert (pressing on a table below with 10 N is F_d = +10 N along +z).
//!
//! The way in is [`Controller`]: `reset`, then one `set_goal` per policy action and one `update` per control sample.
//! Any simulator that fills a [`Measurement`] can use it: the law asks it for the arm's kinematics and inertia. What is built in
//! of the plant is that it has seven joints; its limits are data ([`Arm`]). An arm that is not simulated is driven through [`host`],
//! which bounds what the law may do. The control step does not allocate.

// See clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]
// Nothing on the control loop may panic, with two exceptions: an action of another length than the space's
// (`Controller::set_goal`; a host refuses it), and parts that are used by themselves with settings that nobody checked,
// whose docs say so. Indices are not linted: they run over vectors of fixed length, and the host's fuzz test exercises
// them.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::todo)
)]

mod arm;
mod energy;
mod error;
pub mod host;
mod law;
pub mod name;
mod observer;
pub mod record;
mod spatial;
pub mod wiper;

pub use arm::{Arm, CartesianLimits};
pub use energy::EnergyLedger;
pub use error::{ConfigError, within};
pub use law::{
    action::encode,
    action_space::{ActionEntry, ActionSpace, RateRule, SetPoint},
    adaptation::AdaptiveLaw,
    arm_stability::{LoopOnArm, stable_on},
    built_in::{RecordError, UnknownActionSpace},
    commanded_psi::{CommandedPsi, PsiParameter, PsiRange},
    config::ControllerConfig,
    controller::Controller,
    damping::Damping,
    force::{ForceAxis, ForceConfig, ForceControl},
    gains::Gains,
    goal::GoalRule,
    impedance::{Impedance, impedance},
    interpolator::Interpolation,
    operational_space::OperationalSpace,
    psi::{DeltaSign, Psi},
    stability::{StabilityMargin, stability_margin},
    step_values::{Adapted, Errors},
    stiffness::{Scale, Stiffness, StiffnessRange, StiffnessUnit},
};
pub use observer::MomentumObserver;
pub use spatial::{
    Jacobian, JointMatrix, JointVector, Measurement, Pose, RotationError, Twist, Vector3, Vector6, Wrench, asymmetry,
    pose_error, rotation_from_matrix,
};

#[cfg(test)]
mod testing;
