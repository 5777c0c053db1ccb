//! A resting arm, a host that runs on it, and a count of what a thread allocates.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use aforce::host::{ArmState, Host, HostSetup};
use aforce::{Arm, Pose};
use franka::{Frame, Model, RobotState};

use crate::arm::{arm_state, model_pose};

/// State of a resting Panda, and the tool's pose by the model.
pub fn panda() -> (ArmState, Pose) {
    let model = Model::native_fer();
    let q = [0.0, -0.8, 0.0, -2.4, 0.0, 1.6, 0.8];
    let mut state = RobotState { q, ..RobotState::default() };
    state.O_T_EE = model.pose(Frame::EndEffector, &state);
    (arm_state(&state, &model), model_pose(&state, &model))
}

/// A host that has started in the state of [`panda`].
pub fn host() -> Host {
    let mut setup = HostSetup::from_toml(include_str!("../configs/fr3.toml")).unwrap();
    setup.arm = Arm::PANDA;
    let mut host = Host::new(&setup).unwrap();
    let (state, model) = panda();
    host.start(&state, &model).unwrap();
    host
}

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: hands every call to the system allocator unchanged.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's contract is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's contract is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Number of allocations and deallocations of this thread.
pub fn allocations() -> u64 {
    ALLOCATIONS.with(Cell::get)
}
