//! Measuring and controlling allocate nothing: the fast loop is the same on a real arm.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use aforce::{ActionSpace, Controller, ControllerConfig, Vector3};
use physics::robots::RobotName;
use physics::robots::panda::HOME;
use physics::scenes::lift::Lift;
use physics::{Deviation, Plant, SimulationConfig};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|n| n.set(n.get() + 1));
        // SAFETY: the caller's promises about `layout` are passed on unchanged.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: `pointer` came from `System.alloc` above with the same layout.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn measure_and_update_do_not_allocate() {
    let robot = RobotName::Robosuite.robot();
    let arm = robot.arm;
    let plant = Plant { robot, dt: 0.002, config: SimulationConfig::default(), deviation: Deviation::default() };
    let (mut simulation, _) = Lift::simulate(&plant, Vector3::repeat(0.021));
    simulation.reset(&HOME.into());
    for space in ActionSpace::built_in() {
        let mut controller = Controller::new(&space, &ControllerConfig::default(), &arm, Vector3::z_axis()).unwrap();
        controller.reset(&simulation.measure());
        let action = vec![0.3; space.dim()];
        let before = ALLOCATIONS.with(Cell::get);
        let mut tau = aforce::JointVector::zeros();
        for _ in 0..100 {
            let y = simulation.measure();
            controller.set_goal(&action, &y);
            tau = controller.update(&y);
        }
        assert_eq!(ALLOCATIONS.with(Cell::get) - before, 0, "{space}");
        assert!(tau.norm() > 0.0);
    }
}
