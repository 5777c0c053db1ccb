//! The control law for hosts in C and C++: what `include/aforce.h` declares. See [`aforce::host`] for what it promises.

use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use aforce::host::{Host, HostSetup, NotTaken, pose_from_matrix};

mod convert;
mod text;

use convert::{command, pose_matrix, state};
use text::write_text;

/// Counts up with every change of a struct or a function.
pub const ABI_VERSION: u32 = 1;

/// Marks memory in which a host lives.
const ALIVE: u64 = 0xaf0c_e281_9a3b_5d17;

/// A host in the caller's memory. Zero it before `aforce_init`; do not copy it; `aforce_drop` it in the end.
#[repr(C)]
pub struct AforceHost {
    /// Not for the caller.
    alive: u64,
    /// Not for the caller.
    words: [u64; 2048],
}

const _: () = assert!(size_of::<Host>() + size_of::<u64>() <= size_of::<AforceHost>());
const _: () = assert!(align_of::<Host>() <= align_of::<u64>());

/// What a function has to say.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AforceResult {
    /// Done.
    Ok = 0,
    /// A pointer is null, or the memory holds no host (or already one).
    BadPointer = 1,
    /// The set-up is not allowed; the message says why.
    BadSetup = 2,
    /// The arm's state is refused; the message says why.
    Refused = 3,
    /// The law does not act: not started, stopped, or a fault.
    NotRunning = 4,
    /// The action has not the length of the space, see `aforce_action_length`, or an entry is NaN.
    BadLength = 5,
    /// A defect of this library. The torque, if one was asked for, is zero.
    Internal = 6,
}

/// What the host is at.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AforceStatus {
    /// The law acts.
    Running = 0,
    /// The law acts, and something of it was cut: see `limited`.
    Limited = 1,
    /// Latched: the arm holds its posture, ever more softly. Only `aforce_start` ends it.
    Fault = 2,
    /// Not started, or stopped: the arm holds its posture, ever more softly.
    Stopped = 3,
}

/// What an arm's interface reports at each cycle, in its own conventions: those that the set-up's `interface` names.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct AforceState {
    /// Joint positions (rad).
    pub q: [f64; 7],
    /// Joint velocities (rad/s).
    pub qd: [f64; 7],
    /// Pose of the tool point in the base frame: 4 x 4, column-major (m).
    pub pose: [f64; 16],
    /// Jacobian of the tool point: 6 x 7, column-major, linear rows first, base axes.
    pub jacobian: [f64; 42],
    /// Joint-space mass matrix: 7 x 7 (kg m^2).
    pub mass: [f64; 49],
    /// Torques that hold the resting arm against gravity (Nm).
    pub gravity: [f64; 7],
    /// Torques of Coriolis and centrifugal forces (Nm).
    pub coriolis: [f64; 7],
    /// External wrench (N, Nm).
    pub wrench: [f64; 6],
    /// The torque that the interface took last, without what the arm adds by itself (Nm).
    pub tau: [f64; 7],
}

/// What one cycle gives.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct AforceCommand {
    /// The torque to send (Nm): finite, and within the arm's limits of torque and rate, whatever the status. Zero, which may be a
    /// jump, if the function's result is not AFORCE_RESULT_OK: no host, no state, or a defect. Stop the arm by its own means then.
    pub tau: [f64; 7],
    /// What the host is at.
    pub status: AforceStatus,
    /// What was cut: bit 0 a torque or its rate, 1 the wrench or its rate, 2 the error, 3 the goal, 4 a joint near its end,
    /// 5 energy, 6 F_cmd after lost contact.
    pub limited: u32,
    /// Why the law gave up, or 0: see `aforce_fault_text`.
    pub fault: u32,
    /// Zero.
    pub reserved: u32,
}

/// What the controller can tell of its latest sample. Vectors of six are along and about the axes of the base.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct AforceReadings {
    /// K in the space's own unit (N/m, Nm/rad; or 1/s^2). Along the contact axis the share `engagement` of it does not act.
    pub stiffness: [f64; 6],
    /// F_ff as it acts (N, Nm).
    pub feedforward: [f64; 6],
    /// What the task asks the tool to push with (N, Nm).
    pub wrench: [f64; 6],
    /// e = x - x_d (m, rad).
    pub error: [f64; 6],
    /// The set-point x_d in the base: 4 x 4, column-major (m).
    pub set_point: [f64; 16],
    /// What the environment exerts on the tool, as the law reads it (N, Nm).
    pub external: [f64; 6],
    /// F_d along the contact axis (N).
    pub desired_force: f64,
    /// F_cmd along the contact axis (N).
    pub force_command: f64,
    /// Share of the contact axis that force control has taken over.
    pub engagement: f64,
    /// Level of the energy tank (J).
    pub tank: f64,
}

/// The version of the library: the same as AFORCE_ABI_VERSION, or the header is another's.
#[unsafe(no_mangle)]
pub extern "C" fn aforce_abi_version() -> u32 {
    ABI_VERSION
}

/// Makes a host from a set-up in TOML (docs/drive-your-own-arm.md has one). What is wrong with it is written into `message`, as
/// far as its `size` bytes go, which may be none.
///
/// # Safety
/// `host` must be null or point to a zeroed `AforceHost`, `toml` be null or a string, `message` be null or have `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn aforce_init(
    host: *mut AforceHost,
    toml: *const c_char,
    message: *mut c_char,
    size: usize,
) -> AforceResult {
    guarded(|| {
        if host.is_null() || toml.is_null() {
            return AforceResult::BadPointer;
        }
        // SAFETY: neither is null, and the caller vouches for the rest.
        let (memory, toml) = unsafe { (&mut *host, CStr::from_ptr(toml)) };
        if memory.alive == ALIVE {
            return AforceResult::BadPointer;
        }
        let made = toml
            .to_str()
            .map_err(|error| error.to_string())
            .and_then(|text| HostSetup::from_toml(text).map_err(|error| error.to_string()))
            .and_then(|setup| Host::new(&setup).map_err(|error| error.to_string()));
        match made {
            Ok(made) => {
                // SAFETY: `words` is large enough and aligned, as asserted above.
                unsafe { memory.words.as_mut_ptr().cast::<Host>().write(made) };
                memory.alive = ALIVE;
                AforceResult::Ok
            }
            Err(error) => {
                // SAFETY: the caller vouches for `message` and `size`.
                unsafe { write_text(&error, message, size) };
                AforceResult::BadSetup
            }
        }
    })
}

/// Ends a host and frees what it holds. Memory without a host is left alone.
///
/// # Safety
/// `host` must be null or point to an `AforceHost` that is zeroed or was made by `aforce_init`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn aforce_drop(host: *mut AforceHost) {
    guarded(|| {
        // SAFETY: the caller vouches for it.
        if let Some(memory) = unsafe { host.as_mut() }
            && memory.alive == ALIVE
        {
            memory.alive = 0;
            // SAFETY: the memory held a host, and is no longer marked as holding one.
            unsafe { memory.words.as_mut_ptr().cast::<Host>().drop_in_place() };
        }
        AforceResult::Ok
    });
}

/// Length of an action of the host's space; 0 without a host.
///
/// # Safety
/// As `aforce_drop`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn aforce_action_length(host: *const AforceHost) -> usize {
    // SAFETY: the caller vouches for it.
    unsafe { host.as_ref() }.and_then(alive).map_or(0, |host| host.controller().space().dim())
}

/// The law begins, from `state`. `model` is where the caller's own kinematics see the tool at `state->q`: 16 numbers, 4 x 4,
/// column-major. Give `state->pose` where it comes from them anyway. Why a state is refused is written into `message`.
///
/// # Safety
/// As `aforce_init`; `state` must be null or point to what its type says, `model` be null or point to 16 numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn aforce_start(
    host: *mut AforceHost,
    state: *const AforceState,
    model: *const f64,
    message: *mut c_char,
    size: usize,
) -> AforceResult {
    guarded(|| {
        // SAFETY: the caller vouches for the pointers.
        let (host, state, model) =
            unsafe { (host.as_mut().and_then(alive_mut), state.as_ref(), model.cast::<[f64; 16]>().as_ref()) };
        let (Some(host), Some(state), Some(model)) = (host, state, model) else { return AforceResult::BadPointer };
        match host.start(&self::state(state), &pose_from_matrix(model)) {
            Ok(()) => AforceResult::Ok,
            Err(fault) => {
                // SAFETY: the caller vouches for `message` and `size`.
                unsafe { write_text(&fault, message, size) };
                AforceResult::Refused
            }
        }
    })
}

/// One policy action of `length` entries in [-1, 1] (others are clipped). One with a NaN is not taken, which counts as silence.
///
/// # Safety
/// As `aforce_drop`; `action` must be null or point to `length` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn aforce_set_goal(host: *mut AforceHost, action: *const f64, length: usize) -> AforceResult {
    guarded(|| {
        // SAFETY: the caller vouches for it.
        let host = unsafe { host.as_mut() }.and_then(alive_mut);
        let (Some(host), false) = (host, action.is_null()) else { return AforceResult::BadPointer };
        if length != host.controller().space().dim() {
            return AforceResult::BadLength;
        }
        // SAFETY: not null, and the caller vouches for its length.
        match host.set_goal(unsafe { std::slice::from_raw_parts(action, length) }) {
            Ok(()) => AforceResult::Ok,
            Err(NotTaken::NotRunning) => AforceResult::NotRunning,
            Err(NotTaken::Length { .. }) => AforceResult::BadLength,
        }
    })
}

/// One cycle: the torque for `state`, `dt` seconds after the last cycle. Neither panics nor allocates.
///
/// # Safety
/// As `aforce_drop`; `state` and `command` must be null or point to what their types say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn aforce_update(
    host: *mut AforceHost,
    state: *const AforceState,
    dt: f64,
    command: *mut AforceCommand,
) -> AforceResult {
    if command.is_null() {
        return AforceResult::BadPointer;
    }
    let mut done = AforceCommand { tau: [0.0; 7], status: AforceStatus::Stopped, limited: 0, fault: 0, reserved: 0 };
    let result = guarded(|| {
        // SAFETY: the caller vouches for the pointers.
        let (host, state) = unsafe { (host.as_mut().and_then(alive_mut), state.as_ref()) };
        let (Some(host), Some(state)) = (host, state) else { return AforceResult::BadPointer };
        done = self::command(&host.update(&self::state(state), dt));
        AforceResult::Ok
    });
    // SAFETY: not null, and the caller vouches for the rest. It may be uninitialised: written to, never referred to.
    unsafe { command.write(done) };
    result
}

/// The law ends; the arm holds its posture, ever more softly. A fault stays a fault.
///
/// # Safety
/// As `aforce_drop`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn aforce_stop(host: *mut AforceHost) -> AforceResult {
    guarded(|| {
        // SAFETY: the caller vouches for it.
        let Some(host) = (unsafe { host.as_mut() }).and_then(alive_mut) else { return AforceResult::BadPointer };
        host.stop();
        AforceResult::Ok
    })
}

/// 1 if the hold after a stop or a fault has come down to its lowest stiffness: the motion may end. 0 if not.
///
/// # Safety
/// As `aforce_drop`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn aforce_is_relaxed(host: *const AforceHost) -> i32 {
    // SAFETY: the caller vouches for it.
    i32::from(unsafe { host.as_ref() }.and_then(alive).is_some_and(Host::is_relaxed))
}

/// What the controller can tell of its latest sample.
///
/// # Safety
/// As `aforce_drop`; `readings` must be null or point to what its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn aforce_read(host: *const AforceHost, readings: *mut AforceReadings) -> AforceResult {
    guarded(|| {
        // SAFETY: the caller vouches for it.
        let host = unsafe { host.as_ref() }.and_then(alive);
        let (Some(host), false) = (host, readings.is_null()) else { return AforceResult::BadPointer };
        let controller = host.controller();
        let told = AforceReadings {
            stiffness: (*host.acting_stiffness()).into(),
            feedforward: (*controller.feedforward()).into(),
            wrench: (*controller.wrench()).into(),
            error: (*controller.error()).into(),
            set_point: pose_matrix(controller.set_point()),
            external: host.measurement().map_or([0.0; 6], |y| y.wrench.into()),
            desired_force: controller.desired_force(),
            force_command: controller.force_command(),
            engagement: controller.engagement(),
            tank: host.tank(),
        };
        // SAFETY: not null, and the caller vouches for the rest.
        unsafe { readings.write(told) };
        AforceResult::Ok
    })
}

/// What a result means, in English.
#[unsafe(no_mangle)]
pub extern "C" fn aforce_result_text(result: u32) -> *const c_char {
    text::of_result(result).as_ptr()
}

/// What a fault's code means, in English.
#[unsafe(no_mangle)]
pub extern "C" fn aforce_fault_text(fault: u32) -> *const c_char {
    text::of_fault(fault).as_ptr()
}

/// The host in `memory`, if it holds one.
fn alive(memory: &AforceHost) -> Option<&Host> {
    // SAFETY: the mark is there only while a host is.
    (memory.alive == ALIVE).then(|| unsafe { &*memory.words.as_ptr().cast::<Host>() })
}

fn alive_mut(memory: &mut AforceHost) -> Option<&mut Host> {
    // SAFETY: as above.
    (memory.alive == ALIVE).then(|| unsafe { &mut *memory.words.as_mut_ptr().cast::<Host>() })
}

/// Runs `body`; a panic becomes [`AforceResult::Internal`], as none may unwind into C.
fn guarded(body: impl FnOnce() -> AforceResult) -> AforceResult {
    catch_unwind(AssertUnwindSafe(body)).unwrap_or(AforceResult::Internal)
}
