//! Only `aforce_init` and `aforce_drop` use the heap: no start, refused or not, no action, no cycle and no fault does.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ffi::{CStr, c_char};
use std::mem::MaybeUninit;

use aforce_c::{
    AforceHost, AforceResult, AforceState, aforce_drop, aforce_init, aforce_set_goal, aforce_start, aforce_update,
};

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

const SETUP: &CStr = c"arm = 'fr3'\ninterface = 'plain'\nspace = 'low'\n[controller]\ncontrol_hz = 1000";

/// A resting arm whose tool is 0.5 m in front of the base, and whose joints all turn about z.
fn state() -> AforceState {
    let (mut pose, mut jacobian, mut mass) = ([0.0; 16], [0.0; 42], [0.0; 49]);
    for axis in 0..4 {
        pose[5 * axis] = 1.0;
    }
    (pose[12], pose[14]) = (0.5, 0.3);
    for joint in 0..7 {
        mass[8 * joint] = 1.0;
        jacobian[6 * joint + 5] = 1.0;
    }
    let zero = [0.0; 7];
    let q = [0.0, 0.2, 0.0, -2.0, 0.0, 2.2, 0.8];
    AforceState { q, qd: zero, pose, jacobian, mass, gravity: zero, coriolis: zero, wrench: [0.0; 6], tau: zero }
}

#[test]
fn a_refusal_and_a_fault_use_no_heap() {
    let mut host = MaybeUninit::<AforceHost>::zeroed();
    let mut command = MaybeUninit::uninit();
    let mut message = [1 as c_char; 64];
    let (host, out, size) = (host.as_mut_ptr(), message.as_mut_ptr(), message.len());
    let good = state();
    let model = good.pose.as_ptr();
    // SAFETY: everything lives until the end of the test, and has the size that is passed.
    unsafe {
        assert_eq!(aforce_init(host, SETUP.as_ptr(), out, size), AforceResult::Ok);
        let before = ALLOCATIONS.get();
        let mut broken = state();
        broken.q[3] = 0.5;
        let refused = aforce_start(host, &broken, model, out, size);
        let shorter = [aforce_start(host, &broken, model, out.add(60), 4), aforce_start(host, &broken, model, out, 0)];
        let started = aforce_start(host, &good, model, out, 0);
        let taken = aforce_set_goal(host, [0.1; 6].as_ptr(), 6);
        for dt in [0.001, f64::NAN] {
            aforce_update(host, &good, dt, command.as_mut_ptr());
        }
        let allocations = ALLOCATIONS.get() - before;
        aforce_drop(host);
        assert_eq!(allocations, 0);
        assert_eq!([refused, shorter[0], shorter[1]], [AforceResult::Refused; 3]);
        assert_eq!([started, taken], [AforceResult::Ok; 2]);
        assert_eq!(command.assume_init().fault, 2);
        assert_eq!(CStr::from_ptr(out.add(60)), c"joi");
        assert_eq!(CStr::from_ptr(out).to_str().unwrap(), "joint 4 is at 0.5000 rad; its range: -3.0421 to -0.1518");
    }
}
