//! Threads of one sweep. They live for the call only: nothing is left to deadlock after a fork.

use super::dispatch::worker_of;
use super::outputs::Writer;
use super::worker::Shared;
use super::{Job, MethodName, Outputs};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// How often the calling thread looks up.
const PULSE: Duration = Duration::from_millis(40);

/// Told by the calling thread now and then while a sweep runs.
pub trait Progress {
    /// Rows done and rows in all; false asks for a stop.
    fn keep_going(&mut self, done: usize, rows: usize) -> bool;
}

/// Runs all rows; true where it was interrupted.
pub fn sweep(job: &Job, progress: &mut dyn Progress) -> (Outputs, bool) {
    let mut outputs = Outputs::new(job);
    let mut shared = Shared::new(job, Writer::new(&mut outputs));
    pass(&shared, progress);
    if shared.begin_again(MethodName::Rodas5p) {
        pass(&shared, progress);
    }
    let interrupted = shared.cancelled.load(Ordering::Relaxed);
    let unfinished: Vec<_> = (0..job.rows).map(|row| shared.unfinished(row)).collect();
    outputs.close(&unfinished);
    (outputs, interrupted)
}

/// Runs what is in the queue, on as many of the threads as the system grants; without any, on the calling one.
fn pass(shared: &Shared, progress: &mut dyn Progress) {
    let job = shared.job;
    let worker = worker_of(job, shared.method);
    let working = AtomicUsize::new(0);
    let caller = thread::current();
    thread::scope(|scope| {
        for number in 0..job.threads.min(job.rows * job.runs_per_row()) {
            working.fetch_add(1, Ordering::Relaxed);
            let started = thread::Builder::new().spawn_scoped(scope, || {
                worker(shared);
                working.fetch_sub(1, Ordering::Release);
                caller.unpark();
            });
            if started.is_err() {
                working.fetch_sub(1, Ordering::Relaxed);
                if number == 0 {
                    worker(shared);
                }
                break;
            }
        }
        while working.load(Ordering::Acquire) > 0 {
            thread::park_timeout(PULSE);
            if !progress.keep_going(shared.rows_done(), job.rows) {
                shared.cancelled.store(true, Ordering::Relaxed);
            }
        }
    });
    if !shared.cancelled.load(Ordering::Relaxed) {
        progress.keep_going(shared.rows_done(), job.rows);
    }
}
