//! One connection: a request comes in, an answer goes out, each within its time.

use std::io::{self, ErrorKind, Read, Write};
use std::net::Shutdown;
use std::time::Duration;

use mio::event::Event;
use mio::net::TcpStream;
use mio::{Interest, Registry, Token};

use super::request::{MAX_HEAD, Parsed, Request, parse};
use super::response::Response;
use crate::routing::Time;

/// How long a request may take to come.
const PATIENCE: Duration = Duration::from_secs(5);

/// How long an answer may take to go.
const ANSWER_PATIENCE: Duration = Duration::from_secs(30);

/// What is still taken of somebody who was answered, so that the answer is not lost: closing a socket
/// that has something unread takes back what was sent.
const MAX_IGNORED: usize = 64 * 1_024;

/// Somebody who asks.
#[derive(Debug)]
pub(super) struct Connection {
    stream: TcpStream,
    stage: Stage,
    is_readable: bool,
    deadline: Time,
}

#[derive(Debug)]
enum Stage {
    /// What came of the request so far. Invariant: at most [`MAX_HEAD`] bytes.
    Asking(Vec<u8>),
    /// What was asked, by somebody whose turn has not come.
    PutOff(Request),
    /// What goes out, and how much of it is gone.
    Answering(Vec<u8>, usize),
    /// How much was thrown away since everything is gone.
    Closing(usize),
}

/// How far a connection is.
#[derive(PartialEq, Eq, Debug)]
pub(super) enum Progress {
    /// It waits for the other side.
    Waiting,
    /// A request is to be answered.
    Asked(Request),
    /// It is to be closed.
    Over,
}

impl Connection {
    /// Somebody who was accepted just now.
    pub(super) fn new(
        mut stream: TcpStream,
        registry: &Registry,
        token: Token,
        now: Time,
    ) -> io::Result<Self> {
        registry.register(&mut stream, token, Interest::READABLE | Interest::WRITABLE)?;
        let (stage, deadline) = (Stage::Asking(Vec::new()), now + PATIENCE);
        Ok(Self { stream, stage, is_readable: true, deadline })
    }

    pub(super) fn close(&mut self, registry: &Registry) {
        // Closing it would do; this keeps the system from telling of it once more.
        let _ = registry.deregister(&mut self.stream);
    }

    /// Room to write needs no note: whoever has something to write tries.
    pub(super) fn handle_event(&mut self, event: &Event) {
        self.is_readable |= event.is_readable() || event.is_read_closed() || event.is_error();
    }

    /// When it is over, whatever happens until then.
    pub(super) fn deadline(&self) -> Time {
        self.deadline
    }

    /// Reads and writes what can be now.
    pub(super) fn advance(&mut self, now: Time) -> Progress {
        if self.deadline <= now {
            return Progress::Over;
        }
        let outcome = match self.stage {
            Stage::Asking(_) => self.ask(now),
            Stage::PutOff(request) => Ok(Progress::Asked(request)),
            Stage::Answering(..) => self.write(now),
            Stage::Closing(_) => self.ignore(),
        };
        outcome.unwrap_or_else(|error| match error.kind() {
            ErrorKind::WouldBlock => Progress::Waiting,
            _ => Progress::Over,
        })
    }

    /// The request is to be brought again the next time.
    pub(super) fn put_off(&mut self, request: Request) {
        self.stage = Stage::PutOff(request);
    }

    /// What is to go out.
    pub(super) fn answer(&mut self, response: &Response, is_head: bool) {
        self.stage = Stage::Answering(response.to_bytes(is_head), 0);
    }

    fn ask(&mut self, now: Time) -> io::Result<Progress> {
        loop {
            let mut bytes = [0; 1_024];
            let count = self.read(&mut bytes)?;
            let Stage::Asking(head) = &mut self.stage else { return Ok(Progress::Over) };
            let room = MAX_HEAD - head.len();
            head.extend_from_slice(&bytes[..count.min(room)]);
            let refusal = match parse(head) {
                Parsed::Request(request) => {
                    self.deadline = now + ANSWER_PATIENCE;
                    return Ok(Progress::Asked(request));
                }
                Parsed::Unfinished if count == 0 => return Ok(Progress::Over),
                Parsed::Unfinished => continue,
                Parsed::Refused(status) => Response::refusal(status),
            };
            self.deadline = now + ANSWER_PATIENCE;
            self.answer(&refusal, false);
            return self.write(now);
        }
    }

    fn write(&mut self, now: Time) -> io::Result<Progress> {
        while let Stage::Answering(bytes, sent) = &mut self.stage {
            if *sent == bytes.len() {
                self.stream.shutdown(Shutdown::Write)?;
                self.stage = Stage::Closing(0);
                self.deadline = self.deadline.min(now + Duration::from_secs(1));
                break;
            }
            match self.stream.write(&bytes[*sent..]) {
                Ok(0) => return Ok(Progress::Over),
                Ok(count) => *sent += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        self.ignore()
    }

    /// Waits for the other side to close, so that it has got everything.
    fn ignore(&mut self) -> io::Result<Progress> {
        loop {
            let count = self.read(&mut [0; 4_096])?;
            let Stage::Closing(ignored) = &mut self.stage else { return Ok(Progress::Over) };
            *ignored += count;
            if count == 0 || *ignored > MAX_IGNORED {
                return Ok(Progress::Over);
            }
        }
    }

    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if !self.is_readable {
            return Err(ErrorKind::WouldBlock.into());
        }
        loop {
            match self.stream.read(bytes) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    self.is_readable = false;
                    return Err(error);
                }
                outcome => return outcome,
            }
        }
    }
}
