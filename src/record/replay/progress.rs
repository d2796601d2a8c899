//! How far a replay is, for a person at a terminal.
//!
//! The loop only sets a number. A thread of its own draws, while there is something to draw: a
//! terminal that is stopped stops nothing else.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, Thread};
use std::time::Duration;

use crate::printable::printable;
use crate::record::bars;

/// How often it is drawn.
const PERIOD: Duration = Duration::from_millis(250);

/// What the loop, the reader and the drawer share.
#[derive(Default)]
pub(super) struct Figures {
    /// Bytes of the log that were said.
    said: AtomicU64,
    /// Bytes that it has, once that is known.
    total: AtomicU64,
    has_ended: AtomicBool,
}

impl Figures {
    /// The log has so many bytes.
    pub(super) fn set_total(&self, bytes: u64) {
        self.total.store(bytes, Ordering::Relaxed);
    }
}

/// The side of the loop; when it is dropped, nothing is drawn any more.
pub(super) struct Progress {
    figures: Arc<Figures>,
    drawer: Thread,
}

impl Progress {
    /// Draws a bar for a log if bars are wanted at all.
    ///
    /// # Errors
    ///
    /// If the system refuses a thread.
    pub(super) fn start(path: &Path, figures: &Arc<Figures>) -> io::Result<Option<Self>> {
        if !bars::are_shown() {
            return Ok(None);
        }
        // What is in a name shall command no terminal.
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name = printable(&name);
        let drawn = Arc::clone(figures);
        let draw = move || draw(&name, &drawn);
        let drawer = thread::Builder::new().name("progress".into()).spawn(draw)?;
        Ok(Some(Self { figures: Arc::clone(figures), drawer: drawer.thread().clone() }))
    }

    /// So many bytes of the log were said.
    pub(super) fn set(&self, said: u64) {
        self.figures.said.store(said, Ordering::Relaxed);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.figures.has_ended.store(true, Ordering::Release);
        self.drawer.unpark();
    }
}

fn draw(name: &str, figures: &Figures) {
    let Some(bar) = bars::bar_beside_log(0) else { return };
    bar.set_prefix(format!("{name} "));
    while !figures.has_ended.load(Ordering::Acquire) {
        bar.set_length(figures.total.load(Ordering::Relaxed));
        bar.set_position(figures.said.load(Ordering::Relaxed));
        bar.tick();
        thread::park_timeout(PERIOD);
    }
    bar.finish_and_clear();
}
