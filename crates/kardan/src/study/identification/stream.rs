//! The blocks of a log, one after the other.

use std::sync::mpsc::sync_channel;

use kardan_tables::read::{Block, Log, LogError};

/// Most damaged places of one log that are skipped.
const DAMAGED: usize = 100;

/// Reads the next block, past damaged parts (possibly one group of several); false at the end, or where `failed` stops.
fn next(log: &mut dyn Log, block: &mut Block, damaged: &mut usize, failed: &mut dyn FnMut(LogError) -> bool) -> bool {
    loop {
        match log.next(block) {
            Ok(more) => return more,
            Err(error) => {
                *damaged += 1;
                if !failed(error) || *damaged == DAMAGED {
                    return false;
                }
            }
        }
    }
}

/// All blocks of a log until `smooth` has enough: where a thread can wait, one thread reads while the other one smooths. A worker of the pool
/// in which readers share work must not wait for them: there both alternate.
pub(super) fn stream(log: &mut dyn Log, smooth: &mut dyn FnMut(&mut Block) -> bool, failed: &mut dyn FnMut(LogError)) {
    let mut damaged = 0;
    if rayon::current_thread_index().is_some() {
        let mut block = Block::default();
        let mut report = |error| {
            failed(error);
            true
        };
        while next(log, &mut block, &mut damaged, &mut report) && smooth(&mut block) {}
        return;
    }
    let (full, filled) = sync_channel::<Result<Block, LogError>>(2);
    let (empty, emptied) = sync_channel::<Block>(4);
    for _ in 0..3 {
        let _ = empty.send(Block::default());
    }
    std::thread::scope(|scope| {
        scope.spawn(move || {
            while let Ok(mut block) = emptied.recv() {
                let more = next(log, &mut block, &mut damaged, &mut |error| full.send(Err(error)).is_ok());
                if !more || full.send(Ok(block)).is_err() {
                    break;
                }
            }
        });
        for block in filled {
            match block {
                Ok(mut block) => {
                    if !smooth(&mut block) {
                        break; // the reading thread has no receiver
                    }
                    let _ = empty.send(block);
                }
                Err(error) => failed(error),
            }
        }
        drop(empty); // the reader has ended
    });
}
