//! Processor time.

/// Processor time used by this thread, in seconds; wall time where the system has no such clock.
pub fn thread_seconds() -> f64 {
    cpu_time::ThreadTime::now().as_duration().as_secs_f64()
}
