//! What codes mean, and messages into the caller's memory.

use std::ffi::{CStr, c_char};

pub(crate) fn of_result(result: u32) -> &'static CStr {
    match result {
        0 => c"done",
        1 => c"a pointer is null, or the memory holds no host (or already one)",
        2 => c"the set-up is not allowed",
        3 => c"the arm's state is refused",
        4 => c"the law does not act: not started, stopped, or a fault",
        5 => c"the action has not the length of the space",
        6 => c"a defect of this library",
        _ => c"no such result",
    }
}

pub(crate) fn of_fault(fault: u32) -> &'static CStr {
    match fault {
        0 => c"none",
        1 => c"a field of the arm's state is not finite, or beyond anything an arm has",
        2 => c"the time since the last cycle is no period, or too long",
        3 => c"the mass matrix is not positive definite",
        4 => c"the arm's pose is not the model's",
        5 => c"a joint is outside its range",
        6 => c"a joint is too fast",
        7 => c"the tool has left the workspace",
        8 => c"the environment pushes too hard",
        9 => c"the environment turns too hard",
        10 => c"no action for too long",
        _ => c"no such fault",
    }
}

/// Writes `text` with its zero into `size` bytes at `message`, as far as it goes.
///
/// # Safety
/// `message` must be null or have `size` bytes.
pub(crate) unsafe fn write_text(text: &str, message: *mut c_char, size: usize) {
    if message.is_null() || size == 0 {
        return;
    }
    let length = text.len().min(size - 1);
    // SAFETY: `length` + 1 bytes are the caller's, and no text of ours overlaps them.
    unsafe {
        std::ptr::copy_nonoverlapping(text.as_ptr().cast::<c_char>(), message, length);
        *message.add(length) = 0;
    }
}
