//! Many pieces of work on all threads, their results taken one by one where they are wanted.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;
use std::sync::{Condvar, Mutex, PoisonError};

/// How results are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// As they come.
    Free,
    /// In the order of the work. No piece is begun that is this much ahead of the next one to be taken, so that few results wait.
    Kept(usize),
}

/// What is next to be taken, and whether it makes sense to go on.
struct Gate {
    taken: Mutex<usize>,
    moved: Condvar,
    stopped: AtomicBool,
}

impl Gate {
    fn stop(&self) {
        // Under the lock, so that nobody falls asleep between looking and waiting.
        let _taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        self.stopped.store(true, Ordering::SeqCst);
        self.moved.notify_all();
    }

    fn taken(&self, count: usize) {
        *self.taken.lock().unwrap_or_else(PoisonError::into_inner) = count;
        self.moved.notify_all();
    }

    /// Waits until a piece may be begun; false if none may any more.
    fn wait(&self, piece: usize, order: Order) -> bool {
        if let Order::Kept(ahead) = order {
            let mut taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
            while piece >= taken.saturating_add(ahead) && !self.stopped.load(Ordering::SeqCst) {
                taken = self.moved.wait(taken).unwrap_or_else(PoisonError::into_inner);
            }
        }
        !self.stopped.load(Ordering::SeqCst)
    }
}

/// Does the pieces of work 0 .. `count` on the threads of a pool, each thread one at a time, and hands the results to `take` on the
/// thread of the caller. All ends when a piece gives nothing or `take` breaks; what is being done then is lost.
///
/// Threads are not tasks: a piece that is parallel itself gets help from threads that have nothing left to do, and none of them
/// begins another piece in the middle of one.
pub fn each<T: Send>(
    pool: &rayon::ThreadPool,
    count: usize,
    order: Order,
    work: &(dyn Fn(usize) -> Option<T> + Sync),
    take: &mut dyn FnMut(T) -> ControlFlow<()>,
) {
    let next = AtomicUsize::new(0);
    let gate = Gate { taken: Mutex::new(0), moved: Condvar::new(), stopped: AtomicBool::new(false) };
    let (send, receive) = sync_channel(pool.current_num_threads());
    std::thread::scope(|scope| {
        let (next, gate) = (&next, &gate);
        scope.spawn(move || {
            pool.broadcast(|_| {
                loop {
                    let piece = next.fetch_add(1, Ordering::Relaxed);
                    if piece >= count || !gate.wait(piece, order) {
                        return;
                    }
                    let sent = work(piece).is_some_and(|result| send.send((piece, result)).is_ok());
                    if !sent {
                        return gate.stop();
                    }
                }
            });
        });
        let (mut waiting, mut taken) = (BTreeMap::new(), 0);
        for (piece, result) in receive {
            waiting.insert(piece, result);
            loop {
                let first = match order {
                    Order::Free => waiting.pop_first().map(|(_, result)| result),
                    Order::Kept(_) => waiting.remove(&taken),
                };
                let Some(result) = first else { break };
                if take(result).is_break() {
                    return gate.stop(); // the channel closes, and whoever sends sees it
                }
                taken += 1;
                gate.taken(taken);
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    fn pool(threads: usize) -> rayon::ThreadPool {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
    }

    /// The pieces in the order in which they are handed over, and the last one begun before the first was done, which waits until
    /// that is `until`.
    fn handed(order: Order, until: usize) -> (Vec<usize>, usize) {
        let (mut list, last, seen) = (vec![], AtomicUsize::new(0), AtomicUsize::new(0));
        let work = |i: usize| {
            last.fetch_max(i, Ordering::SeqCst);
            if i == 0 {
                let begin = Instant::now();
                while last.load(Ordering::SeqCst) < until && begin.elapsed() < Duration::from_secs(60) {
                    std::thread::sleep(Duration::from_millis(1));
                }
                std::thread::sleep(Duration::from_millis(20)); // for others that should not begin, but would
                seen.store(last.load(Ordering::SeqCst), Ordering::SeqCst);
            }
            Some(i)
        };
        each(&pool(4), 1000, order, &work, &mut |i| {
            list.push(i);
            ControlFlow::Continue(())
        });
        (list, seen.into_inner())
    }

    #[test]
    fn order_is_kept_and_little_waits() {
        let all: Vec<usize> = (0..1000).collect();
        assert_eq!(handed(Order::Kept(10), 9), (all.clone(), 9));
        let (mut free, last) = handed(Order::Free, 999);
        assert!(last == 999 && free[0] != 0, "nobody waits for the slow one: {last}, {}", free[0]);
        free.sort_unstable();
        assert_eq!(free, all);
    }

    #[test]
    fn it_ends_when_it_is_asked_to() {
        for order in [Order::Free, Order::Kept(3)] {
            let mut seen = 0;
            each(&pool(3), usize::MAX, order, &Some, &mut |_| {
                seen += 1;
                if seen == 7 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            assert_eq!(seen, 7);
            each(&pool(3), usize::MAX, order, &|i| (i != 20).then_some(i), &mut |_| ControlFlow::Continue(()));
        }
    }
}
