//! What the program writes to standard error: read by a thread, so that a test can wait for a line.

use std::io::{BufRead, BufReader, Read};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread;
use std::time::Instant;

use super::PATIENCE;

#[derive(Default)]
struct State {
    /// The lines so far.
    lines: Vec<String>,
    /// Whether no more will come: the program has closed its standard error, or nobody reads it.
    ended: bool,
    /// Whether nobody is to read it any more.
    unheard: bool,
    /// Whether nobody is to read it for now.
    paused: bool,
}

/// A log that grows while the program runs.
#[derive(Clone)]
pub(crate) struct Log(Arc<(Mutex<State>, Condvar)>);

impl Log {
    /// Reads `source` to its end on a thread of its own.
    pub(crate) fn follow(source: impl Read + Send + 'static) -> Self {
        let log = Self(Arc::default());
        let writer = log.clone();
        thread::spawn(move || {
            for line in BufReader::new(source).split(b'\n') {
                let Ok(line) = line else { break };
                let line = String::from_utf8_lossy(&line).into_owned();
                writer.change(|state| state.lines.push(line));
                let resumed = writer.0.1.wait_while(writer.state(), |state| state.paused);
                if resumed.expect("the log").unheard {
                    break;
                }
            }
            writer.change(|state| state.ended = true);
        });
        log
    }

    /// Closes the reading end behind the next line, as a terminal that is gone.
    pub(crate) fn hang_up(&self) {
        self.change(|state| state.unheard = true);
    }

    /// Stops reading behind the next line, as a terminal that was told to wait.
    pub(crate) fn pause(&self) {
        self.change(|state| state.paused = true);
    }

    /// Waits for a line that holds all of `words`, from the first line on.
    pub(crate) fn wait_for(&self, words: &[&str]) -> String {
        self.wait_from(0, words)
    }

    /// The same, from the line number `from` on; see [`Self::len`].
    pub(crate) fn wait_from(&self, from: usize, words: &[&str]) -> String {
        let has_all = |line: &&String| has_all(line, words);
        let found = self.wait_until(|state| {
            let later = state.lines.get(from..).unwrap_or_default();
            later.iter().find(has_all).cloned()
        });
        found.unwrap_or_else(|| panic!("no line with {words:?} in the log:\n{}", self.text()))
    }

    /// Waits for the program to close its standard error; gives everything that it wrote.
    pub(crate) fn wait_for_end(&self) -> String {
        let text = self.wait_until(|state| state.ended.then(|| state.lines.join("\n")));
        text.unwrap_or_else(|| panic!("the program still runs:\n{}", self.text()))
    }

    /// How many lines there are.
    pub(crate) fn len(&self) -> usize {
        self.lines().len()
    }

    /// Whether a line holds all of `words`.
    pub(crate) fn has(&self, words: &[&str]) -> bool {
        let lines = self.lines();
        lines.iter().any(|line| has_all(line, words))
    }

    /// All lines so far.
    pub(crate) fn lines(&self) -> Vec<String> {
        self.state().lines.clone()
    }

    /// All lines so far, or the last hundred of very many.
    pub(crate) fn text(&self) -> String {
        let lines = self.lines();
        lines[lines.len().saturating_sub(100)..].join("\n")
    }

    /// Waits for `find` to find something; `None` when patience ends or nothing more can come.
    fn wait_until<T>(&self, find: impl Fn(&State) -> Option<T>) -> Option<T> {
        let deadline = Instant::now() + PATIENCE;
        let mut state = self.state();
        loop {
            if let Some(found) = find(&state) {
                return Some(found);
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() || state.ended {
                return None;
            }
            state = self.0.1.wait_timeout(state, left).expect("the log").0;
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.0.lock().expect("the log")
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.state());
        self.0.1.notify_all();
    }
}

/// Whether each of `words` stands in `line`, and not as the end of a longer word.
fn has_all(line: &str, words: &[&str]) -> bool {
    let in_a_word = |at: usize, word: &str| {
        let before = line[..at].chars().next_back();
        word.starts_with(char::is_alphanumeric) && before.is_some_and(char::is_alphanumeric)
    };
    let stands = |word: &&str| line.match_indices(*word).any(|(at, _)| !in_a_word(at, word));
    words.iter().all(stands)
}
