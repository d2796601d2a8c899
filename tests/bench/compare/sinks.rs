//! Everybody who is to hear the frames: one thread that notes how old each was when it came.

use std::io::{ErrorKind, Read};
use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use mavswitch::mavlink::{Frame, FrameError};
use mio::net::{TcpStream, UdpSocket as PolledUdp};
use mio::{Events, Interest, Poll, Token};

use super::load::{COMMAND, TELEMETRY, clock};

/// One who hears.
enum Ear {
    Datagrams(PolledUdp),
    Stream(TcpStream),
}

impl Ear {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match self {
            Self::Datagrams(socket) => socket.recv(buffer),
            Self::Stream(stream) => stream.read(buffer),
        }
    }
}

/// What has been heard so far, for other threads to look at.
#[derive(Default)]
pub(crate) struct Heard {
    frames: AtomicU64,
    measuring: AtomicBool,
    ends: AtomicBool,
}

impl Heard {
    /// How many frames came, to all ears together.
    pub(crate) fn frames(&self) -> u64 {
        self.frames.load(Ordering::Relaxed)
    }
}

/// All the ears.
pub(crate) struct Sinks {
    pub(crate) heard: Arc<Heard>,
    thread: JoinHandle<Vec<u64>>,
}

impl Sinks {
    /// Begins to listen.
    pub(crate) fn new(udp: Vec<UdpSocket>, tcp: Vec<std::net::TcpStream>) -> Self {
        let heard = Arc::new(Heard::default());
        let mut ears = Vec::new();
        for socket in udp {
            socket.set_nonblocking(true).expect("a socket that does not wait");
            ears.push(Ear::Datagrams(PolledUdp::from_std(socket)));
        }
        for stream in tcp {
            stream.set_nonblocking(true).expect("a socket that does not wait");
            ears.push(Ear::Stream(TcpStream::from_std(stream)));
        }
        let listener = Listener::new(ears, heard.clone());
        Self { heard, thread: thread::spawn(move || listener.listen()) }
    }

    /// From now on ages are noted.
    pub(crate) fn begin(&self) {
        self.heard.measuring.store(true, Ordering::Relaxed);
    }

    /// Ends, and gives the ages in nanoseconds, in order.
    pub(crate) fn end(self) -> Vec<u64> {
        self.heard.ends.store(true, Ordering::Relaxed);
        let mut ages = self.thread.join().expect("a listener that does not panic");
        ages.sort_unstable();
        ages
    }
}

struct Listener {
    ears: Vec<(Ear, Cut)>,
    heard: Arc<Heard>,
    ages: Vec<u64>,
    buffer: Vec<u8>,
}

impl Listener {
    fn new(ears: Vec<Ear>, heard: Arc<Heard>) -> Self {
        let ears = ears.into_iter().map(|ear| (ear, Cut::default())).collect();
        Self { ears, heard, ages: Vec::with_capacity(1 << 20), buffer: vec![0; 1 << 16] }
    }

    fn listen(mut self) -> Vec<u64> {
        let mut poll = Poll::new().expect("a poll");
        for (at, (ear, _)) in self.ears.iter_mut().enumerate() {
            let registry = poll.registry();
            let registered = match ear {
                Ear::Datagrams(socket) => registry.register(socket, Token(at), Interest::READABLE),
                Ear::Stream(stream) => registry.register(stream, Token(at), Interest::READABLE),
            };
            registered.expect("an ear that can be waited for");
        }
        let mut events = Events::with_capacity(1024);
        while !self.heard.ends.load(Ordering::Relaxed) {
            match poll.poll(&mut events, Some(Duration::from_millis(20))) {
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                result => result.expect("a poll that works"),
            }
            for event in &events {
                self.hear(event.token().0);
            }
        }
        self.ages
    }

    fn hear(&mut self, at: usize) {
        let (ear, cut) = &mut self.ears[at];
        let measuring = self.heard.measuring.load(Ordering::Relaxed);
        loop {
            // A connection that ends shows up as frames that are missing.
            let Ok(count @ 1..) = ear.read(&mut self.buffer) else { return };
            let now = clock();
            let mut frames = 0;
            cut.take(&self.buffer[..count], |made| {
                frames += 1;
                if measuring {
                    self.ages.push(now.saturating_sub(made));
                }
            });
            self.heard.frames.fetch_add(frames, Ordering::Relaxed);
        }
    }
}

/// Takes frames from bytes that may be cut anywhere: who knows nothing of frames may cut them.
#[derive(Default)]
struct Cut {
    kept: Vec<u8>,
}

impl Cut {
    fn take(&mut self, bytes: &[u8], mut each: impl FnMut(u64)) {
        self.kept.extend_from_slice(bytes);
        let mut at = 0;
        loop {
            match Frame::parse(&self.kept[at..]) {
                Ok(frame) => {
                    let id = frame.header().id;
                    if (id == TELEMETRY || id == COMMAND) && frame.payload().len() >= 33 {
                        let made = frame.payload()[..8].try_into().expect("eight bytes");
                        each(u64::from_le_bytes(made));
                    }
                    at += frame.bytes().len();
                }
                Err(FrameError::Incomplete) => break,
                Err(_) => at += 1,
            }
        }
        self.kept.drain(..at);
    }
}
