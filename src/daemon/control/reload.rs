//! The request `reload`: the same as SIGHUP, and whoever asked is told what came of it.

use super::super::event_loop::Daemon;
use super::client::Mode;
use crate::control::Answer;

impl Daemon {
    /// Has the configuration read anew; the client waits for the outcome, and is asked nothing until
    /// then.
    pub(super) fn begin_reload(&mut self, slot: usize, id: u64) {
        self.set_mode(slot, Mode::Reloading { id });
        self.ask_reload();
    }

    /// Tells all who wait for it what came of a reload.
    pub(in crate::daemon) fn answer_reload(&mut self, answer: &Answer) {
        for slot in 0..self.control.clients.len() {
            let Some(client) = &mut self.control.clients[slot] else { continue };
            if let Mode::Reloading { id } = client.mode {
                client.mode = Mode::Asking;
                client.last_progress = self.now;
                self.send_answer(slot, id, answer.clone());
                // It may have asked for more meanwhile, or have gone.
                self.control.has_work = true;
            }
        }
    }
}
