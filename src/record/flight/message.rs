//! The few messages that flight-stack logs are asked for and sent with, as fields at their offsets.

use crate::mavlink::{Component, Frame, FrameSpec, MessageId, Version, encode, trimmed};

pub(super) const COMMAND_LONG: MessageId = MessageId(76);
pub(super) const REMOTE_LOG_DATA_BLOCK: MessageId = MessageId(184);
pub(super) const REMOTE_LOG_BLOCK_STATUS: MessageId = MessageId(185);
pub(super) const LOGGING_DATA: MessageId = MessageId(266);
pub(super) const LOGGING_DATA_ACKED: MessageId = MessageId(267);
pub(super) const LOGGING_ACK: MessageId = MessageId(268);

/// MAV_COMP_ID_LOG: who we are in the system of the vehicle whose log we take.
pub(super) const LOGGER: u8 = 155;

/// The autopilot of a vehicle.
pub(super) const AUTOPILOT: u8 = 1;

/// MAV_CMD_LOGGING_START and MAV_CMD_LOGGING_STOP.
pub(super) const START: u16 = 2510;
pub(super) const STOP: u16 = 2511;

/// What is to be said to a vehicle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Said {
    pub(super) id: MessageId,
    pub(super) crc_extra: u8,
    pub(super) len: usize,
    pub(super) payload: [u8; 33],
}

impl Said {
    fn new(id: MessageId, crc_extra: u8, len: usize) -> Self {
        Self { id, crc_extra, len, payload: [0; 33] }
    }

    /// A command to start or to stop sending ULog.
    pub(super) fn command(system: u8, command: u16) -> Self {
        let mut said = Self::new(COMMAND_LONG, 152, 33);
        said.payload[28..30].copy_from_slice(&command.to_le_bytes());
        said.payload[30..32].copy_from_slice(&[system, AUTOPILOT]);
        said
    }

    /// A piece of ULog has arrived.
    pub(super) fn logging_ack(system: u8, sequence: u16) -> Self {
        let mut said = Self::new(LOGGING_ACK, 14, 4);
        said.payload[..2].copy_from_slice(&sequence.to_le_bytes());
        said.payload[2..4].copy_from_slice(&[system, AUTOPILOT]);
        said
    }

    /// A DataFlash block has arrived, or has not.
    pub(super) fn block_status(system: u8, number: u32, has_arrived: bool) -> Self {
        let mut said = Self::new(REMOTE_LOG_BLOCK_STATUS, 186, 7);
        said.payload[..4].copy_from_slice(&number.to_le_bytes());
        said.payload[4..7].copy_from_slice(&[system, AUTOPILOT, u8::from(has_arrived)]);
        said
    }

    /// Appends it as a frame of ours.
    pub(super) fn encode(&self, system: u8, seq: u8, out: &mut Vec<u8>) {
        let payload = trimmed(&self.payload[..self.len]);
        let spec = FrameSpec {
            version: Version::V2,
            seq,
            source: Component::new(system, LOGGER),
            id: self.id,
            crc_extra: self.crc_extra,
            payload,
            signature: None,
        };
        encode(&spec, out);
    }
}

/// What a vehicle says about its log.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Heard {
    /// A command was answered: which, and with which MAV_RESULT.
    Answer(u16, u8),
    /// A piece of ULog.
    Ulog(UlogPiece),
    /// A DataFlash block: its number and its bytes.
    Block(u32, [u8; BLOCK]),
}

/// A piece of ULog.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct UlogPiece {
    pub(super) sequence: u16,
    /// Whether it is sent again until it is acknowledged.
    pub(super) wants_ack: bool,
    /// Where in `data` the first ULog message begins; `None` if none does.
    pub(super) first: Option<usize>,
    /// At most 249 bytes.
    pub(super) data: Vec<u8>,
}

/// The length of a DataFlash block.
pub(super) const BLOCK: usize = 200;

/// The longest piece of ULog.
const PIECE: usize = 249;

impl Heard {
    /// What a frame says about a log, if it says so to us.
    pub(super) fn read(frame: &Frame<'_>) -> Option<Self> {
        let byte = |at: usize| frame.payload().get(at).copied().unwrap_or(0);
        let short = |at: usize| u16::from_le_bytes([byte(at), byte(at + 1)]);
        let is_ours = |at: usize| {
            let (system, component) = (byte(at), byte(at + 1));
            let is_system = system == 0 || system == frame.header().source.system;
            is_system && (component == 0 || component == LOGGER)
        };
        match frame.header().id {
            MessageId::COMMAND_ACK if is_ours(8) => Some(Self::Answer(short(0), byte(2))),
            LOGGING_DATA | LOGGING_DATA_ACKED if is_ours(2) => {
                let len = usize::from(byte(4)).min(PIECE);
                let first = Some(usize::from(byte(5))).filter(|first| *first < len);
                Some(Self::Ulog(UlogPiece {
                    sequence: short(0),
                    wants_ack: frame.header().id == LOGGING_DATA_ACKED,
                    first,
                    data: (6..6 + len).map(byte).collect(),
                }))
            }
            REMOTE_LOG_DATA_BLOCK if is_ours(4) => {
                let number = u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)]);
                Some(Self::Block(number, std::array::from_fn(|at| byte(6 + at))))
            }
            _ => None,
        }
    }
}
