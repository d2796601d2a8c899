//! One client of the control socket: bytes in as lines, lines out as bytes, both bounded.

use std::io::{self, ErrorKind, Read, Write};
use std::time::Duration;

use mio::event::{Event, Source};
use mio::net::UnixStream;
use mio::{Interest, Registry, Token};

use super::listen::Listening;
use crate::control::{Answer, AnswerLine, MAX_REQUEST};
use crate::routing::Time;

/// Room that an answer has left behind is given back above this.
const KEPT: usize = 16 * 1_024;

/// Somebody at the control socket.
#[derive(Debug)]
pub(super) struct ControlClient {
    stream: UnixStream,
    /// What it sent and nobody has looked at. Invariant: at most [`MAX_REQUEST`] bytes.
    input: Vec<u8>,
    /// What it is to get, and how much of that it has got.
    output: Vec<u8>,
    sent: usize,
    is_readable: bool,
    /// Whether it will send no more.
    has_ended: bool,
    /// Whether it will take no more either.
    has_gone: bool,
    pub(super) mode: Mode,
    /// When something was last taken from it, or by it.
    pub(super) last_progress: Time,
}

/// What is done for a client without being asked again.
#[derive(Debug)]
pub(super) enum Mode {
    /// Nothing.
    Asking,
    /// It gets pictures.
    Following { id: u64, interval: Duration, next: Time },
    /// It gets frames: those that it wants to see.
    Listening(Box<Listening>),
    /// It gets what came of a reload, and nothing before that.
    Reloading { id: u64 },
    /// It gets what it is still to get, and no more.
    Closing,
}

/// What has come from a client.
#[derive(Debug)]
pub(super) enum Input {
    /// A line, without its end.
    Line(Vec<u8>),
    /// More than a line may have; the answer to that.
    TooLong(AnswerLine),
    /// Nothing to be done for now.
    Nothing,
    /// It has gone, or is to go.
    End,
}

impl ControlClient {
    pub(super) fn new(stream: UnixStream, now: Time) -> Self {
        Self {
            stream,
            input: Vec::new(),
            output: Vec::new(),
            sent: 0,
            is_readable: true,
            has_ended: false,
            has_gone: false,
            mode: Mode::Asking,
            last_progress: now,
        }
    }

    pub(super) fn register(
        &mut self,
        registry: &Registry,
        token: Token,
        interest: Interest,
    ) -> io::Result<()> {
        self.stream.register(registry, token, interest)
    }

    pub(super) fn deregister(&mut self, registry: &Registry) {
        // Closing it would do; this keeps the system from telling of it once more.
        let _ = self.stream.deregister(registry);
    }

    /// Room to write needs no note: whoever has something to write tries.
    pub(super) fn handle_event(&mut self, event: &Event) {
        self.is_readable |= event.is_readable() || event.is_read_closed() || event.is_error();
        self.has_gone |= event.is_write_closed();
    }

    /// Queues a line, or leaves it out if something waits already; says which.
    pub(super) fn push(&mut self, line: &[u8]) -> bool {
        let is_free = self.output.is_empty();
        if is_free {
            self.output.extend_from_slice(line);
        }
        is_free
    }

    /// Queues a line behind what waits; whoever calls has seen to it that there is room.
    pub(super) fn append(&mut self, line: &[u8]) {
        self.output.drain(..self.sent);
        self.sent = 0;
        self.output.extend_from_slice(line);
    }

    /// How many bytes wait for it.
    pub(super) fn waiting(&self) -> usize {
        self.output.len() - self.sent
    }

    /// Writes what the system takes; `false` if the client is gone.
    pub(super) fn flush(&mut self, now: Time) -> bool {
        while self.sent < self.output.len() {
            match self.stream.write(&self.output[self.sent..]) {
                Ok(0) => return false,
                Ok(count) => (self.sent, self.last_progress) = (self.sent + count, now),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return error.kind() == ErrorKind::WouldBlock,
            }
        }
        self.sent = 0;
        self.output.clear();
        self.output.shrink_to(KEPT);
        true
    }

    /// The id under which a picture is due that can be sent now.
    pub(super) fn take_due(&mut self, now: Time) -> Option<u64> {
        let Mode::Following { id, interval, next } = &mut self.mode else { return None };
        if *next > now {
            return None;
        }
        // Not behind itself: who was away for a while gets one picture, not all of them.
        *next = now + *interval;
        self.output.is_empty().then_some(*id)
    }

    /// The next line, if the answer to the one before has been taken.
    pub(super) fn next_line(&mut self, now: Time) -> Input {
        if !self.output.is_empty() {
            return Input::Nothing;
        }
        match self.mode {
            Mode::Closing => return Input::End,
            Mode::Reloading { .. } if self.has_gone => return Input::End,
            Mode::Reloading { .. } => return Input::Nothing,
            _ => {}
        }
        loop {
            if let Some(end) = self.input.iter().position(|byte| *byte == b'\n') {
                self.last_progress = now;
                let mut line: Vec<u8> = self.input.drain(..=end).collect();
                line.truncate(end);
                return Input::Line(line);
            }
            if self.input.len() >= MAX_REQUEST {
                let text = format!("a request has at most {MAX_REQUEST} bytes in one line");
                return Input::TooLong(AnswerLine::new(0, Answer::Error(text)));
            }
            if self.has_ended {
                let is_served = matches!(self.mode, Mode::Following { .. } | Mode::Listening(_));
                return if is_served && !self.has_gone { Input::Nothing } else { Input::End };
            }
            if !self.is_readable {
                return Input::Nothing;
            }
            if !self.read() {
                return Input::End;
            }
        }
    }

    /// Reads what there is room for; `false` if the client is gone.
    fn read(&mut self) -> bool {
        let mut bytes = [0; MAX_REQUEST];
        let room = MAX_REQUEST - self.input.len();
        match self.stream.read(&mut bytes[..room]) {
            Ok(0) => self.has_ended = true,
            Ok(count) => self.input.extend_from_slice(&bytes[..count]),
            Err(error) if error.kind() == ErrorKind::WouldBlock => self.is_readable = false,
            Err(error) => return error.kind() == ErrorKind::Interrupted,
        }
        true
    }

    /// Whether it will send no more.
    #[cfg(test)]
    pub(super) fn has_ended(&self) -> bool {
        self.has_ended
    }

    /// Whether it has asked for nothing that goes on.
    pub(super) fn is_idle(&self) -> bool {
        matches!(self.mode, Mode::Asking) && self.output.is_empty()
    }

    /// Whether nothing can come of it unless it does something.
    pub(super) fn is_stuck(&self) -> bool {
        matches!(self.mode, Mode::Asking) || !self.output.is_empty()
    }

    /// When there is something to do for it if nothing happens.
    pub(super) fn deadline(&self, idle: Duration) -> Option<Time> {
        match self.mode {
            Mode::Following { next, .. } if self.output.is_empty() => Some(next),
            // Nothing may pass for hours, and a disk may stand still.
            Mode::Listening(_) | Mode::Reloading { .. } if self.output.is_empty() => None,
            _ => Some(self.last_progress + idle),
        }
    }
}

/// Tells somebody for whom there is no room, if that can be said at once, and lets go.
pub(super) fn refuse(mut stream: UnixStream, answer: &AnswerLine) {
    let _ = stream.write(&answer.to_line());
}
