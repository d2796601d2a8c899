//! The loop's buffers: datagrams come in and go out by the batch.

use std::io::{self, ErrorKind::ConnectionRefused, ErrorKind::WouldBlock};
use std::net::SocketAddr;
use std::os::fd::AsFd;

use mio::net::UdpSocket;

use super::sys::{self, Received};
use crate::mavlink::Splitter;

/// How many datagrams one system call moves at most.
pub const BATCH: usize = sys::BATCH;

/// How many are asked for at once where fewer came the last time: to ask for more costs time.
const FEW: usize = 4;

/// The longest UDP payload over IPv4.
const MAX_DATAGRAM: usize = 65_507;

/// Each slot begins with the room that [`Splitter::cut`] asks for.
const SLOT: usize = Splitter::CARRY + MAX_DATAGRAM;

/// Where everything that is received stands while it is routed. One for the whole program.
///
/// Memory that was never written to costs nothing, so the size of the slots is no burden.
pub struct Inbox {
    slots: Vec<u8>,
    received: [Received; BATCH],
    /// How many came the last time.
    came: usize,
}

/// How many datagrams came.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Arrived {
    /// How many: they stand in the first slots.
    pub count: usize,
    /// Whether there are no more for now.
    pub drained: bool,
}

impl Inbox {
    /// An empty one.
    pub fn new() -> Self {
        let received = [Received { len: 0, source: None }; BATCH];
        Self { slots: vec![0; SLOT * BATCH], received, came: 0 }
    }

    /// Receives up to [`BATCH`] datagrams, one into each slot.
    ///
    /// # Errors
    ///
    /// As `recvmmsg(2)`; `WouldBlock` if there is none.
    pub fn receive(&mut self, socket: &UdpSocket) -> io::Result<Arrived> {
        let result = match self.came {
            0..2 => self.receive_singly(socket),
            2..FEW => self.receive_some::<FEW>(socket),
            _ => self.receive_some::<BATCH>(socket),
        };
        self.came = result.as_ref().map_or(0, |arrived| arrived.count);
        result
    }

    /// For one datagram, and to hear that there is no other, two calls are less work for the system
    /// than one for several.
    fn receive_singly(&mut self, socket: &UdpSocket) -> io::Result<Arrived> {
        let mut count = 0;
        while count < FEW {
            match socket.recv_from(&mut self.slot(count)[Splitter::CARRY..]) {
                Ok((len, source)) => {
                    self.received[count] = Received { len, source: Some(source) };
                    count += 1;
                }
                // Those before it are here. What does not pass by itself is told by the next call.
                Err(error) if count > 0 => {
                    return Ok(Arrived { count, drained: error.kind() == WouldBlock });
                }
                Err(error) => return Err(error),
            }
        }
        Ok(Arrived { count, drained: false })
    }

    fn receive_some<const N: usize>(&mut self, socket: &UdpSocket) -> io::Result<Arrived> {
        let mut slots = self.slots.chunks_exact_mut(SLOT);
        let mut buffers: [&mut [u8]; N] = std::array::from_fn(|_| match slots.next() {
            Some(slot) => &mut slot[Splitter::CARRY..],
            None => &mut [],
        });
        let count = sys::receive_batch(socket, &mut buffers, &mut self.received)?;
        Ok(Arrived { count, drained: count < N })
    }

    /// The length and the source of the datagram in a slot.
    pub fn received(&self, slot: usize) -> (usize, Option<SocketAddr>) {
        let Received { len, source } = self.received[slot];
        (len, source)
    }

    /// A slot, with the splitter's room in front.
    pub fn slot(&mut self, slot: usize) -> &mut [u8] {
        &mut self.slots[slot * SLOT..][..SLOT]
    }

    /// Where a stream is read to: the first slot, behind the splitter's room.
    pub fn stream_buffer(&mut self) -> &mut [u8] {
        &mut self.slot(0)[Splitter::CARRY..]
    }
}

impl Default for Inbox {
    fn default() -> Self {
        Self::new()
    }
}

/// What became of datagrams.
#[derive(Debug)]
pub struct Sent {
    /// How many went.
    pub count: usize,
    /// What stopped the next one.
    pub error: Option<io::Error>,
    /// Whether earlier ones were refused where they were sent to.
    pub refused: bool,
}

/// Sends `datagrams`, each in two pieces, to `destination`, at most [`BATCH`] of them.
pub fn send_datagrams<'a>(
    socket: impl AsFd,
    destination: SocketAddr,
    datagrams: impl Iterator<Item = (&'a [u8], &'a [u8])>,
) -> Sent {
    let mut batch: [(&[u8], &[u8]); BATCH] = [(&[], &[]); BATCH];
    let mut count = 0;
    for (place, pieces) in batch.iter_mut().zip(datagrams) {
        *place = pieces;
        count += 1;
    }
    let mut sent = Sent { count: 0, error: None, refused: false };
    let mut refusals = 0;
    while sent.count < count {
        match sys::send_batch(socket.as_fd(), destination, &batch[sent.count..count]) {
            Ok(more) => sent.count += more,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            // The answer to an earlier one; this one has not been tried. More answers than
            // datagrams are no answers.
            Err(error) if error.kind() == ConnectionRefused && refusals <= count => {
                refusals += 1;
                sent.refused = true;
            }
            Err(error) => {
                sent.error = Some(error);
                break;
            }
        }
    }
    sent
}
