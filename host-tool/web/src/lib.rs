//! Sessions on the native simulator for a page in a browser, compiled to WebAssembly.
//!
//! This crate has a C interface of four functions. The page writes a request as JSON into
//! [`flexor_room`], calls [`flexor_call`], and reads the answer at [`flexor_answer`]: JSON, or the
//! bytes of a file. After a panic, [`flexor_panic`] has the message. What a session means and what a
//! record contains is in `host-core`; this crate converts requests and answers, and keeps files in
//! memory. It has no clock, network or file system. The integrators of the accuracy–speed chart are a
//! module of their own, with the same interface.
//!
//! Input: requests (`call::Call`, `integrate::Integration`). Output: JSON and files.

#[cfg(feature = "sessions")]
mod call;
#[cfg(feature = "sessions")]
mod catalogue;
#[cfg(feature = "sessions")]
mod check;
#[cfg(feature = "sessions")]
mod describe;
#[cfg(feature = "sessions")]
mod draw;
mod error;
#[cfg(feature = "integrators")]
mod integrate;
#[cfg(feature = "sessions")]
mod memory;
#[cfg(feature = "sessions")]
mod models;
#[cfg(feature = "sessions")]
mod playback;
#[cfg(feature = "sessions")]
mod playbacks;
#[cfg(feature = "sessions")]
mod tap;

#[cfg(feature = "sessions")]
use call::Page;
#[cfg(not(feature = "sessions"))]
use integrate::Page;
use std::cell::RefCell;

/// Longest request, bytes. The longest session text is shorter.
const LONGEST_REQUEST: usize = 4 << 20;

thread_local! {
    static REQUEST: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static ANSWER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static PAGE: RefCell<Option<Page>> = const { RefCell::new(None) };
}

/// Makes room for a request of `length` bytes, and returns its address; 0 for a request that is too
/// long.
// SAFETY: no other function of this module has this name.
#[unsafe(no_mangle)]
pub extern "C" fn flexor_room(length: usize) -> *mut u8 {
    if length > LONGEST_REQUEST {
        return std::ptr::null_mut();
    }
    REQUEST.with_borrow_mut(|request| {
        request.clear();
        request.resize(length, 0);
        request.as_mut_ptr()
    })
}

/// Carries out the request. Returns the length of the answer, bytes; negative if the answer is an
/// error.
// SAFETY: no other function of this module has this name.
#[unsafe(no_mangle)]
pub extern "C" fn flexor_call() -> i32 {
    PAGE.with_borrow_mut(|page| {
        let page = page.get_or_insert_with(|| {
            std::panic::set_hook(Box::new(|panic| store(panic.to_string().into_bytes())));
            Page::default()
        });
        let request = REQUEST.take();
        let answered = page.answer(&request);
        let (answer, sign) = match answered {
            Ok(answer) => (answer, 1),
            Err(error) => (error.to_json(), -1),
        };
        let length = i32::try_from(answer.len()).unwrap_or(i32::MAX);
        store(answer);
        sign * length
    })
}

/// Returns the address of the latest answer.
// SAFETY: no other function of this module has this name.
#[unsafe(no_mangle)]
pub extern "C" fn flexor_answer() -> *const u8 {
    ANSWER.with_borrow(|answer| answer.as_ptr())
}

/// Returns the length of the message that a panic left at [`flexor_answer`], bytes.
// SAFETY: no other function of this module has this name.
#[unsafe(no_mangle)]
pub extern "C" fn flexor_panic() -> usize {
    ANSWER.with_borrow(Vec::len)
}

fn store(bytes: Vec<u8>) {
    ANSWER.with_borrow_mut(|answer| *answer = bytes);
}
