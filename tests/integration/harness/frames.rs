//! Frames with readable names, for the tests to send.

use mavswitch::mavlink::{
    CheckedFrame, Component, Crc, FrameBuffer, FrameSpec, Header, Key, MessageId, Timestamp,
    Version, encode, implied_extra, trimmed,
};

/// A message: its id, its CRC_EXTRA and the length of its payload.
#[derive(Clone, Copy)]
pub(crate) struct Message {
    pub(crate) id: u32,
    pub(crate) extra: u8,
    pub(crate) len: usize,
}

const fn message(id: u32, extra: u8, len: usize) -> Message {
    Message { id, extra, len }
}

pub(crate) const HEARTBEAT: Message = message(0, 50, 9);
pub(crate) const SYSTEM_TIME: Message = message(2, 137, 12);
pub(crate) const SET_MODE: Message = message(11, 89, 6);
pub(crate) const PARAM_REQUEST_LIST: Message = message(21, 159, 2);
pub(crate) const ATTITUDE: Message = message(30, 39, 28);
pub(crate) const COMMAND_LONG: Message = message(76, 152, 33);
pub(crate) const COMMAND_ACK: Message = message(77, 143, 10);
pub(crate) const FILE_TRANSFER_PROTOCOL: Message = message(110, 84, 254);
pub(crate) const ENCAPSULATED_DATA: Message = message(131, 223, 255);
pub(crate) const SETUP_SIGNING: Message = message(256, 71, 42);
pub(crate) const STATUSTEXT: Message = message(253, 83, 54);
/// In nobody's definitions.
pub(crate) const UNKNOWN: Message = message(4_242_424, 201, 12);

/// A frame in the making; MAVLink 2, trimmed and unsigned unless told otherwise.
#[derive(Clone)]
pub(crate) struct Draft {
    source: Component,
    message: Message,
    payload: Vec<u8>,
    version: Version,
    seq: u8,
    compat: u8,
    signature: Option<[u8; 13]>,
    trim: bool,
}

impl Draft {
    /// A message with this payload; what is missing of its length is zero.
    pub(crate) fn new(source: Component, message: Message, payload: impl Into<Vec<u8>>) -> Self {
        let mut payload = payload.into();
        payload.resize(payload.len().max(message.len), 0);
        let version = Version::V2;
        Self { source, message, payload, version, seq: 7, compat: 0, signature: None, trim: true }
    }

    /// MAVLink 1, which has no trimming.
    pub(crate) fn v1(self) -> Self {
        Self { version: Version::V1, trim: false, ..self }
    }

    /// With a signature, as good as any to who has no key.
    pub(crate) fn signed(self) -> Self {
        let signature = *b"\x03\x40\x42\x0f\0\0\0signed";
        Self { signature: Some(signature), ..self }
    }

    /// With the zeros at its end, as some senders leave them.
    pub(crate) fn untrimmed(self) -> Self {
        Self { trim: false, ..self }
    }

    /// With another sequence number than 7.
    pub(crate) fn seq(self, seq: u8) -> Self {
        Self { seq, ..self }
    }

    /// With compatibility flags.
    pub(crate) fn compat(self, compat: u8) -> Self {
        Self { compat, ..self }
    }

    /// The frame.
    pub(crate) fn build(&self) -> Vec<u8> {
        let payload = if self.trim { trimmed(&self.payload) } else { &self.payload };
        let spec = FrameSpec {
            version: self.version,
            seq: self.seq,
            source: self.source,
            id: MessageId(self.message.id),
            crc_extra: self.message.extra,
            payload,
            signature: self.signature,
        };
        let mut frame = Vec::new();
        encode(&spec, &mut frame);
        if self.compat != 0 {
            frame[3] = self.compat;
            let end = 10 + payload.len();
            let checksum = Crc::step(Crc::of(&frame[1..end]), self.message.extra);
            frame[end..end + 2].copy_from_slice(&checksum.to_le_bytes());
        }
        frame
    }
}

/// HEARTBEAT.
pub(crate) fn heartbeat(from: Component) -> Vec<u8> {
    heartbeat_draft(from).build()
}

/// HEARTBEAT, to be changed.
pub(crate) fn heartbeat_draft(from: Component) -> Draft {
    Draft::new(from, HEARTBEAT, [0, 0, 0, 0, 6, 8, 0, 4, 3])
}

/// ATTITUDE number `n`: telemetry, which is for everybody.
pub(crate) fn attitude(from: Component, n: u32) -> Vec<u8> {
    let mut payload = n.to_le_bytes().to_vec();
    payload.resize(ATTITUDE.len - 1, 0x3f);
    payload.push(0x40);
    Draft::new(from, ATTITUDE, payload).seq(n.to_le_bytes()[0]).build()
}

/// The number of an [`attitude`] or of a [`bulk`].
pub(crate) fn number_in(frame: &[u8]) -> u32 {
    u32::from_le_bytes([frame[10], frame[11], frame[12], frame[13]])
}

/// ENCAPSULATED_DATA number `n`: telemetry that fills 267 bytes, hard to mistake for another.
pub(crate) fn bulk(from: Component, n: u32) -> Vec<u8> {
    let mut payload = n.to_le_bytes().to_vec();
    let filler = u8::try_from(n % 251).expect("below 251");
    payload.resize(ENCAPSULATED_DATA.len, filler | 1);
    Draft::new(from, ENCAPSULATED_DATA, payload).seq(n.to_le_bytes()[0]).build()
}

/// COMMAND_LONG: arm, if you like.
pub(crate) fn command_long(from: Component, to: Component) -> Vec<u8> {
    command_long_draft(from, to).build()
}

/// COMMAND_LONG, to be changed.
pub(crate) fn command_long_draft(from: Component, to: Component) -> Draft {
    let mut payload = vec![0; COMMAND_LONG.len];
    payload[28..33].copy_from_slice(&[0x90, 1, to.system, to.component, 1]);
    Draft::new(from, COMMAND_LONG, payload)
}

/// COMMAND_ACK in MAVLink 2, where it has a target.
pub(crate) fn command_ack(from: Component, to: Component) -> Vec<u8> {
    let payload = [0x90, 1, 0, 0, 0, 0, 0, 0, to.system, to.component];
    Draft::new(from, COMMAND_ACK, payload).build()
}

/// COMMAND_ACK in MAVLink 1, where it has none.
pub(crate) fn command_ack_v1(from: Component) -> Vec<u8> {
    let message = Message { len: 3, ..COMMAND_ACK };
    Draft::new(from, message, [0x90, 1, 4]).v1().build()
}

/// PARAM_REQUEST_LIST.
pub(crate) fn param_request_list(from: Component, to: Component) -> Vec<u8> {
    Draft::new(from, PARAM_REQUEST_LIST, [to.system, to.component]).build()
}

/// SET_MODE, which names a system and no component.
pub(crate) fn set_mode(from: Component, system: u8) -> Vec<u8> {
    Draft::new(from, SET_MODE, [4, 0, 0, 0, system, 1]).build()
}

/// SYSTEM_TIME: so long after boot.
pub(crate) fn system_time(from: Component, since_boot_ms: u32) -> Vec<u8> {
    let mut payload = vec![7; 8];
    payload.extend(since_boot_ms.to_le_bytes());
    Draft::new(from, SYSTEM_TIME, payload).build()
}

/// SETUP_SIGNING, with a key of no secrecy.
pub(crate) fn setup_signing(from: Component, to: Component) -> Vec<u8> {
    let mut payload = vec![1, 2, 3, 4, 5, 6, 7, 8, to.system, to.component];
    payload.resize(SETUP_SIGNING.len, 0x11);
    Draft::new(from, SETUP_SIGNING, payload).build()
}

/// FILE_TRANSFER_PROTOCOL, 266 bytes, its data full of MAVLink 2 start bytes.
pub(crate) fn ftp_full_of_start_bytes(from: Component, to: Component, seq: u8) -> Vec<u8> {
    ftp_of_transfer(0xfdfd, from, to, seq)
}

/// The same of one of many transfers that have no frame in common.
pub(crate) fn ftp_of_transfer(number: u16, from: Component, to: Component, seq: u8) -> Vec<u8> {
    let [high, low] = number.to_be_bytes();
    let mut payload = vec![0, to.system, to.component, high, low];
    payload.resize(FILE_TRANSFER_PROTOCOL.len, 0xfd);
    Draft::new(from, FILE_TRANSFER_PROTOCOL, payload).seq(seq).build()
}

/// A message that is in nobody's definitions, number `n`.
pub(crate) fn unknown(from: Component, n: u32) -> Vec<u8> {
    let mut payload = n.to_le_bytes().to_vec();
    payload.resize(UNKNOWN.len, 0x77);
    Draft::new(from, UNKNOWN, payload).build()
}

/// The unsigned frame damaged on its way so that no CRC_EXTRA at all explains it.
pub(crate) fn corrupted(frame: &[u8]) -> Vec<u8> {
    let mut damaged = frame.to_vec();
    let end = frame.len() - 2;
    loop {
        damaged[end - 1] = damaged[end - 1].wrapping_add(1);
        let received = u16::from_le_bytes([damaged[end], damaged[end + 1]]);
        if implied_extra(Crc::of(&damaged[1..end]), received).is_none() {
            return damaged;
        }
    }
}

/// One frame of each shape that may occur; all are for everybody.
pub(crate) fn every_shape(from: Component) -> Vec<Vec<u8>> {
    let everybody = Component::new(0, 0);
    let full = Draft::new(from, ENCAPSULATED_DATA, [0x55; 255]);
    let text = Draft::new(from, STATUSTEXT, *b"\x04text\0junk behind the end of the string");
    let empty = Draft { payload: Vec::new(), ..Draft::new(from, PARAM_REQUEST_LIST, []) };
    let longer = Draft::new(from, HEARTBEAT, [9, 0, 0, 0, 250, 8, 0, 4, 3, 1, 2, 3]);
    vec![
        heartbeat(from),
        heartbeat_draft(from).v1().build(),
        heartbeat_draft(from).signed().build(),
        command_long(from, everybody),
        command_long_draft(from, everybody).v1().build(),
        command_long_draft(from, everybody).untrimmed().build(),
        command_long_draft(from, everybody).signed().untrimmed().build(),
        heartbeat_draft(from).compat(0x80).build(),
        full.build(),
        full.clone().v1().build(),
        full.signed().build(),
        text.build(),
        text.signed().build(),
        empty.untrimmed().build(),
        longer.build(),
        longer.v1().build(),
        command_ack_v1(from),
        ftp_full_of_start_bytes(from, everybody, 3),
        unknown(from, 1),
    ]
}

/// A frame of MAVLink 2 as somebody with the key sends it at that time.
pub(crate) fn signed_by(frame: &[u8], key: &Key, at: Timestamp) -> Vec<u8> {
    let header = Header::parse(frame).expect("a frame");
    let frame = CheckedFrame { bytes: frame, header, target: header.source, verified: true };
    let mut buffer = FrameBuffer::default();
    buffer.sign(&frame, key, 1, at).expect("an unsigned frame of MAVLink 2").bytes.to_vec()
}
