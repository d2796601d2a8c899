//! A peer of the router: somebody with a component id at the far end of a link.

use std::time::{Duration, Instant};

use mavswitch::mavlink::Component;

use super::cutter::Cutter;
use super::{PATIENCE, marks};

/// What came out of a wire.
pub(crate) enum Received {
    /// So many bytes.
    Bytes(usize),
    /// Nothing in the time given.
    Nothing,
    /// The end.
    Closed,
}

/// A way for bytes to the router and back.
pub(crate) trait Wire {
    /// Whether each receive gives one datagram, which then holds one frame.
    const DATAGRAMS: bool;
    /// Sends all of it, as one datagram where there are datagrams.
    fn send(&mut self, bytes: &[u8]);
    /// Waits for bytes.
    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> Received;
}

/// Somebody who sends frames and says which ones must come.
///
/// Marks (see [`marks`]) are passed over wherever frames are expected.
pub(crate) struct Peer<W: Wire> {
    pub(crate) wire: W,
    me: Component,
    cutter: Cutter,
    /// The numbers of the marks that this peer sent, and so must never receive.
    own_marks: Vec<u32>,
    /// Whether frames with this peer's own id are passed over.
    deaf_to_own_id: bool,
}

impl<W: Wire> Peer<W> {
    /// A peer that speaks as `me`.
    pub(crate) fn new(wire: W, me: Component) -> Self {
        Self { wire, me, cutter: Cutter::default(), own_marks: Vec::new(), deaf_to_own_id: false }
    }

    /// For a component with two links: passes over what it hears of its other self.
    ///
    /// Whether it hears that depends on the time since it last spoke, which a test cannot command.
    pub(crate) fn deaf_to_own_id(self) -> Self {
        Self { deaf_to_own_id: true, ..self }
    }

    /// Sends bytes as they are: one write, or one datagram.
    pub(crate) fn send(&mut self, bytes: impl AsRef<[u8]>) {
        self.wire.send(bytes.as_ref());
    }

    /// Sends each frame by itself.
    pub(crate) fn send_each(&mut self, frames: &[Vec<u8>]) {
        for frame in frames {
            self.wire.send(frame);
        }
    }

    /// Sends each byte by itself.
    pub(crate) fn send_bytewise(&mut self, bytes: &[u8]) {
        for byte in bytes.chunks(1) {
            self.wire.send(byte);
        }
    }

    /// Sends a new mark; everybody else who hears this peer knows its number then.
    pub(crate) fn send_mark(&mut self) -> u32 {
        let (number, frame) = marks::mark(self.me);
        self.own_marks.push(number);
        self.wire.send(&frame);
        number
    }

    /// The next frame.
    pub(crate) fn receive(&mut self) -> Vec<u8> {
        let me = self.me;
        self.try_receive(PATIENCE).unwrap_or_else(|| panic!("nothing came for {me}"))
    }

    /// Reads once what is there or comes very soon, be it the end, and gives this peer back.
    pub(crate) fn receive_some(mut self) -> Self {
        let _ = self.fill(Instant::now() + Duration::from_millis(5));
        self
    }

    /// The next frame, if one comes in that time.
    pub(crate) fn try_receive(&mut self, timeout: Duration) -> Option<Vec<u8>> {
        let deadline = Instant::now() + timeout;
        loop {
            let frame = self.next(deadline)?;
            if marks::number_of(&frame).is_none() {
                return Some(frame);
            }
        }
    }

    /// The next frame must be this one, byte for byte.
    #[track_caller]
    pub(crate) fn expect(&mut self, frame: impl AsRef<[u8]>) {
        let (received, frame) = (self.receive(), frame.as_ref());
        let (got, want) = (Shown(&received), Shown(frame));
        assert!(received == frame, "{} received\n  {got}\ninstead of\n  {want}", self.me);
    }

    /// The next frames must be these, in this order.
    #[track_caller]
    pub(crate) fn expect_each(&mut self, frames: &[Vec<u8>]) {
        for frame in frames {
            self.expect(frame);
        }
    }

    /// Nothing of what `sender` sent so far and this peer has not yet received may arrive.
    #[track_caller]
    pub(crate) fn expect_nothing_from(&mut self, sender: &mut Peer<impl Wire>) {
        if let Some(frame) = self.receive_rest_from(sender).first() {
            panic!("{} received what it should not:\n  {}", self.me, Shown(frame));
        }
    }

    /// Everything else that arrives of what `sender` has sent so far.
    pub(crate) fn receive_rest_from(&mut self, sender: &mut Peer<impl Wire>) -> Vec<Vec<u8>> {
        let number = sender.send_mark();
        let deadline = Instant::now() + PATIENCE;
        let mut rest = Vec::new();
        loop {
            let Some(frame) = self.next(deadline) else {
                panic!("{} does not hear {} at all", self.me, sender.me);
            };
            match marks::number_of(&frame) {
                Some(found) if found == number => return rest,
                Some(_) => {}
                None => rest.push(frame),
            }
        }
    }

    /// Lets `sender` speak until this peer hears it; gives what else arrived meanwhile.
    ///
    /// For when the way may not be open yet, or may be full.
    pub(crate) fn meet(&mut self, sender: &mut Peer<impl Wire>) -> Vec<Vec<u8>> {
        let give_up = Instant::now() + PATIENCE;
        let (mut numbers, mut rest) = (Vec::new(), Vec::new());
        loop {
            assert!(Instant::now() < give_up, "{} never hears {}", self.me, sender.me);
            numbers.push(sender.send_mark());
            let pause = Instant::now() + Duration::from_millis(100);
            while let Some(frame) = self.next(pause) {
                match marks::number_of(&frame) {
                    Some(found) if numbers.contains(&found) => return rest,
                    Some(_) => {}
                    None => rest.push(frame),
                }
            }
        }
    }

    /// Waits for the end of the link; only whole frames may come before it.
    pub(crate) fn receive_to_end(&mut self) -> Vec<Vec<u8>> {
        let frames = self.receive_to_cut();
        assert!(self.cutter.is_empty(), "the link ended within a frame");
        frames
    }

    /// The same where the last frame may be cut short, as when the connection is given up.
    pub(crate) fn receive_to_cut(&mut self) -> Vec<Vec<u8>> {
        let deadline = Instant::now() + PATIENCE;
        let mut frames = Vec::new();
        loop {
            while let Some(frame) = self.cutter.next() {
                frames.extend(marks::number_of(&frame).is_none().then_some(frame));
            }
            assert!(Instant::now() < deadline, "the link stays open");
            match self.fill(deadline) {
                Received::Bytes(_) | Received::Nothing => {}
                Received::Closed => return frames,
            }
        }
    }

    /// The next frame or mark before `deadline`.
    fn next(&mut self, deadline: Instant) -> Option<Vec<u8>> {
        loop {
            if let Some(frame) = self.cutter.next() {
                if W::DATAGRAMS {
                    assert!(self.cutter.is_empty(), "more than one frame in a datagram");
                }
                if let Some(number) = marks::number_of(&frame) {
                    assert!(!self.own_marks.contains(&number), "{} hears its echo", self.me);
                } else if self.deaf_to_own_id && source_of(&frame) == self.me {
                    continue;
                }
                return Some(frame);
            }
            match self.fill(deadline) {
                Received::Bytes(_) => {}
                Received::Nothing => return None,
                Received::Closed => panic!("the router closed the link of {}", self.me),
            }
        }
    }

    fn fill(&mut self, deadline: Instant) -> Received {
        let mut buffer = [0; 65536];
        let left = deadline.saturating_duration_since(Instant::now());
        // A wait of zero would mean for ever.
        let received = self.wire.receive(&mut buffer, left.max(Duration::from_millis(1)));
        if let Received::Bytes(count) = received {
            self.cutter.feed(&buffer[..count]);
            assert!(!W::DATAGRAMS || count >= 8, "a datagram too short for a frame");
        }
        received
    }
}

/// Who made this frame.
pub(crate) fn source_of(frame: &[u8]) -> Component {
    let at = if frame[0] == 0xfe { 3 } else { 5 };
    Component::new(frame[at], frame[at + 1])
}

/// A frame, for a message to the reader of a failed test.
struct Shown<'a>(&'a [u8]);

impl std::fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match mavswitch::mavlink::Header::parse(self.0) {
            Ok(header) => {
                write!(f, "id {} from {} seq {}: ", header.id, header.source, header.seq)?;
            }
            Err(error) => write!(f, "{error:?}: ")?,
        }
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}
