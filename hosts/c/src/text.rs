//! Texts of result and fault codes, and messages written into the caller's memory.

use std::ffi::{CStr, c_char};
use std::fmt::{self, Display, Write};
use std::mem::MaybeUninit;

use aforce::host::Fault;

pub(crate) fn of_result(result: u32) -> &'static CStr {
    match result {
        0 => c"done",
        1 => c"a pointer is null, or the memory holds no host (or already one)",
        2 => c"the set-up is not allowed",
        3 => c"the arm's state is refused",
        4 => c"the law does not act: not started, stopped, or a fault",
        5 => c"the action has not the length of the space, or an entry is NaN",
        6 => c"a defect of this library",
        _ => c"no such result",
    }
}

pub(crate) fn of_fault(fault: u32) -> &'static CStr {
    if fault == 0 { c"none" } else { Fault::text(fault).unwrap_or(c"no such fault") }
}

/// Writes `text` with a terminating zero into the `size` bytes at `message`, cut off where it is too long. Does not allocate.
///
/// # Safety
/// `message` must be null or have `size` bytes.
pub(crate) unsafe fn write_text(text: &impl Display, message: *mut c_char, size: usize) {
    if message.is_null() || size == 0 {
        return;
    }
    // SAFETY: the bytes are the caller's, and nothing else writes to them meanwhile.
    let mut buffer =
        Buffer { free: unsafe { std::slice::from_raw_parts_mut(message.cast::<MaybeUninit<u8>>(), size) } };
    // Text that does not fit is cut off, which is not an error.
    let _ = write!(buffer, "{text}");
    buffer.free[0].write(0);
}

/// The unwritten bytes of the caller's memory: at least one, for the terminating zero.
struct Buffer<'a> {
    free: &'a mut [MaybeUninit<u8>],
}

impl Write for Buffer<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let length = text.len().min(self.free.len() - 1);
        let (now, rest) = std::mem::take(&mut self.free).split_at_mut(length);
        now.write_copy_of_slice(&text.as_bytes()[..length]);
        self.free = rest;
        Ok(())
    }
}
