//! A resting arm, and a host that runs on it.

use aforce::host::{ArmState, Host, HostSetup};
use aforce::{Arm, Pose};
use franka::{Frame, Model, RobotState};

use crate::arm::{arm_state, model_pose};

/// What a Panda's interface reports, and where the model sees the tool.
pub fn panda() -> (ArmState, Pose) {
    let model = Model::native_fer();
    let q = [0.0, -0.8, 0.0, -2.4, 0.0, 1.6, 0.8];
    let mut state = RobotState { q, ..RobotState::default() };
    state.O_T_EE = model.pose(Frame::EndEffector, &state);
    (arm_state(&state, &model), model_pose(&state, &model))
}

/// A host that has started there.
pub fn host() -> Host {
    let mut setup = HostSetup::from_toml(include_str!("../configs/fr3.toml")).unwrap();
    setup.arm = Arm::PANDA;
    let mut host = Host::new(&setup).unwrap();
    let (state, model) = panda();
    host.start(&state, &model).unwrap();
    host
}
