//! The law on an arm that is not simulated: what a host provides, what it receives, and what is guaranteed.
//!
//! A host is the program that talks to the arm at 1 kHz. It fills an [`ArmState`] in the arm's own conventions, which an
//! [`ArmInterface`] names once, and calls
//!
//! ```text
//! host.start(&state, &model_pose)?          // refused with the two numbers that disagree
//! loop {
//!     let _ = host.set_goal(&action)        // when the policy has one, at 20 Hz; refused after a fault, while the loop goes on
//!     let command = host.update(&state, dt) // at each cycle
//!     send(command.tau)                     // whatever command.status says
//! }
//! ```
//!
//! Guaranteed for any state and any period: [`Command::tau`] is finite and within the arm's limits of torque and rate; nothing panics or
//! allocates; a fault latches, and the arm then holds its posture, with a stiffness that falls to a low value, until a new start. The
//! bounds of [`HostLimits`] stand between law and arm. In simulation [`Controller`](crate::Controller) runs alone, without these bounds.

mod agreement;
mod bounds;
mod hold;
mod interface;
mod limits;
mod running;
mod sent;
mod setup;
mod status;
mod tank;

pub use hold::HoldConfig;
pub use interface::{
    ArmInterface, ArmState, CompensatedBy, Friction, InertiaSide, WrenchAxes, WrenchSign, WrenchSource,
    pose_from_matrix,
};
pub use limits::HostLimits;
pub use running::Host;
pub use setup::{HostSetup, SetupError, contact_axis};
pub use status::{Command, Fault, Limited, NotTaken, Status};
pub use tank::TankConfig;

#[cfg(test)]
mod tests;
