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
//! An [`ActionSpace`] is a data record that says which of these a policy commands, and by which rules. In a space whose stiffness is in
//! 1/s^2, F_ff, K e and D e_dot are accelerations, which the arm's inertia Lambda turns into a wrench. In a space that damps against
//! standstill, e_dot is x_dot alone ([`RateRule`]). The controller replaces F_d by the output of the force controller that holds F_d
//! ([`ForceConfig`]).
//!
//! Conventions, used everywhere: SI units; six-vectors are *linear first*, in world axes, at the tool point; a [`Wrench`] in a
//! [`Measurement`] is what the environment exerts *on the tool*, and F_d is the wrench that the environment *should* exert (pressing on a
//! table below with 10 N is F_d = +10 N along +z).
//!
//! Start with [`Controller`]: `reset`, then one `set_goal` per policy action and one `update` per control sample. Any simulator that fills
//! a [`Measurement`], which holds the arm's kinematics and inertia, can use the law. The law requires seven joints; the arm's limits are
//! data ([`Arm`]). An arm that is not simulated is driven through [`host`], which bounds what the law may do. The control step does not
//! allocate.

// clippy.toml lists these methods: their last bits differ between processors.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]
// Nothing on the control loop may panic, with two exceptions: an action of another length than the space's (`Controller::set_goal`; a host
// refuses it), and parts that are used by themselves with unchecked settings, whose docs say so. Indices are not linted: they run over
// vectors of fixed length, and the host's fuzz test exercises them.
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
