//! The control step allocates nothing: neither `update` nor `set_goal`.

mod arm;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use aforce::host::{ArmInterface, Host, HostLimits, HostSetup, Status};
use aforce::{
    ActionSpace, Arm, Controller, ControllerConfig, ForceConfig, Interpolation, Jacobian, JointMatrix, JointVector,
    Measurement, Pose, Twist, Vector3, Wrench,
};
use arm::{BallArm, HOME};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: hands every call to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's contract is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's contract is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A fixed arm of full rank.
fn measurement() -> Measurement {
    let jacobian = Jacobian::from_fn(|i, j| if i == j { 1.0 } else { 0.1 * (i as f64 - 0.7 * j as f64).sin() });
    let root = JointMatrix::from_fn(|i, j| 0.2 * (i as f64 + 2.0 * j as f64).cos());
    Measurement {
        q: JointVector::repeat(0.3),
        qd: JointVector::repeat(0.01),
        pose: Pose::new(Vector3::new(0.5, 0.0, 0.3), Vector3::new(3.1, 0.1, 0.0)),
        twist: Twist::repeat(0.01),
        jacobian,
        mass: root * root.transpose() + JointMatrix::identity(),
        bias: JointVector::repeat(1.0),
        wrench: Wrench::new(0.0, 0.0, 10.0, 0.0, 0.0, 0.0),
    }
}

#[test]
fn the_control_step_allocates_nothing() {
    let arm = Arm { torque_max: [80.0; 7], torque_rate_max: [1000.0; 7], ..Arm::PANDA };
    let y = measurement();
    for interpolation in [Interpolation::Linear { ramp_ratio: 1.0 }, Interpolation::JerkLimited { dynamics: 1.0 }] {
        let config = ControllerConfig { interpolation, ..ControllerConfig::default() };
        for space in ActionSpace::built_in() {
            let mut control = Controller::new(&space, &config, &arm, Vector3::z_axis()).unwrap();
            control.reset(&y);
            let (mut in_goals, mut in_updates) = (0, 0);
            for step in 0..20 {
                let action = [0.9 * f64::sin(f64::from(step)); 13];
                let start = ALLOCATIONS.get();
                control.set_goal(&action[..space.dim()], &y);
                in_goals += ALLOCATIONS.get() - start;
                let start = ALLOCATIONS.get();
                for _ in 0..25 {
                    std::hint::black_box(control.update(&y));
                }
                in_updates += ALLOCATIONS.get() - start;
            }
            assert_eq!((in_goals, in_updates), (0, 0), "{space} {interpolation:?}");
        }
    }
}

/// The same for a host's cycle, with its bounds and while it holds the arm after a fault.
#[test]
fn a_hosts_cycle_allocates_nothing() {
    let mut arm = BallArm::at(HOME, ArmInterface::PLAIN);
    let setup = HostSetup {
        contact_axis: [0.0, 0.0, 1.0],
        arm: Arm::FR3,
        interface: ArmInterface::PLAIN,
        limits: HostLimits::default(),
        controller: ControllerConfig {
            control_hz: 1000,
            interpolation: Interpolation::JerkLimited { dynamics: 0.3 },
            force: ForceConfig { force_max: 30.0, ..ForceConfig::default() },
            ..ControllerConfig::default()
        },
        space: "aforce-force".parse().unwrap(),
    };
    let mut host = Host::new(&setup).unwrap();
    let mut allocations = 0;
    for cycle in 0..1000 {
        let state = arm.state();
        let before = ALLOCATIONS.get();
        if cycle == 0 {
            host.start(&state, &state.pose).unwrap();
        }
        if cycle % 50 == 0 {
            let _ = host.set_goal(&[0.2; 7]);
        }
        let broken = if cycle == 700 { f64::NAN } else { 0.001 };
        let command = std::hint::black_box(host.update(&state, broken));
        allocations += ALLOCATIONS.get() - before;
        assert_eq!(matches!(command.status, Status::Fault(_)), cycle >= 700, "{:?}", command.status);
        arm.tau = command.tau;
        arm.advance(0.001);
    }
    assert_eq!(allocations, 0);
}
