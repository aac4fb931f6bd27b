//! Executable memory: written first, then executable and never written again.

use std::ptr::{NonNull, null_mut};

/// Code in memory of its own.
#[derive(Debug)]
pub struct Executable {
    start: NonNull<libc::c_void>,
    length: usize,
}

// SAFETY: the memory is only read and executed from its making to its end.
unsafe impl Send for Executable {}
// SAFETY: as above.
unsafe impl Sync for Executable {}

impl Executable {
    /// Makes code executable; none where the system does not allow it.
    pub fn new(code: &[u8]) -> Option<Self> {
        let length = code.len().max(1);
        // SAFETY: new memory of that length, to which there is no other reference.
        let start = unsafe {
            let (access, kind) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
            libc::mmap(null_mut(), length, access, kind, -1, 0)
        };
        if start == libc::MAP_FAILED {
            return None;
        }
        let own = Self { start: NonNull::new(start)?, length };
        // SAFETY: the memory is ours, writable, and as long as the code; then it is made executable and no longer writable.
        let allowed = unsafe {
            std::ptr::copy_nonoverlapping(code.as_ptr(), own.start.as_ptr().cast(), code.len());
            libc::mprotect(own.start.as_ptr(), own.length, libc::PROT_READ | libc::PROT_EXEC) == 0
        };
        allowed.then_some(own)
    }

    /// Where it begins.
    pub fn start(&self) -> *const u8 {
        self.start.as_ptr().cast::<u8>()
    }
}

impl Drop for Executable {
    fn drop(&mut self) {
        // SAFETY: mapped in `new` with this length, and not used after this.
        unsafe { libc::munmap(self.start.as_ptr(), self.length) };
    }
}
