//! Ctrl-C: the first stops the run and lets what was found be written, the second stops at once.

use std::sync::atomic::{AtomicU8, Ordering};

/// Nobody has asked to stop.
const RUNNING: u8 = 0;
/// Somebody has.
const ASKED: u8 = 1;
/// Files are being written, which takes no time and must not be cut short.
const WRITING: u8 = 2;

static STATE: AtomicU8 = AtomicU8::new(RUNNING);

/// Listens from now on.
pub fn listen() {
    let _ = ctrlc::set_handler(|| match STATE.compare_exchange(RUNNING, ASKED, Ordering::SeqCst, Ordering::SeqCst) {
        Ok(_) => super::say("interrupted: what was found is written after this state; once more to stop at once"),
        Err(ASKED) => std::process::exit(130),
        Err(_) => {}
    });
}

/// True once somebody has asked to stop.
pub fn asked() -> bool {
    STATE.load(Ordering::SeqCst) == ASKED
}

/// Whether somebody has asked to stop; from now on files are written, or else a request stops at once.
pub fn finish(writing: bool) -> bool {
    STATE.swap(if writing { WRITING } else { ASKED }, Ordering::SeqCst) == ASKED
}
