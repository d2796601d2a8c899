//! The tokens of the poll: which event belongs to whom.

use mio::Token;

use crate::routing::LinkId;

/// What a token of the poll means.
pub(super) enum Meaning {
    Signal,
    Wake,
    Alarm,
    /// Whoever has this place in the table.
    Endpoint(u16),
    Link(LinkId),
    /// The control socket, 0, or one of its clients.
    Control(u8),
    /// The port for metrics, 0, or one of its connections.
    Http(u8),
}

const SIGNAL: Token = Token(0);
const WAKE: Token = Token(1);
const ALARM: Token = Token(2);

/// The first token behind those of endpoints and links.
const CONTROL: usize = 1 << 20;

/// The first token behind those of the control socket.
const HTTP: usize = CONTROL + (1 << 8);

impl Meaning {
    /// The token of its events.
    pub(super) fn token(&self) -> Token {
        match self {
            Self::Signal => SIGNAL,
            Self::Wake => WAKE,
            Self::Alarm => ALARM,
            Self::Endpoint(slot) => Token(4 + usize::from(*slot) * 2),
            Self::Link(link) => Token(5 + link.index() * 2),
            Self::Control(number) => Token(CONTROL + usize::from(*number)),
            Self::Http(number) => Token(HTTP + usize::from(*number)),
        }
    }

    /// What an event of this token is about; `None` for a token that nobody has.
    pub(super) fn of(token: Token) -> Option<Self> {
        Some(match token {
            SIGNAL => Self::Signal,
            WAKE => Self::Wake,
            ALARM => Self::Alarm,
            Token(number) if number >= HTTP => Self::Http(u8::try_from(number - HTTP).ok()?),
            Token(number) if number >= CONTROL => {
                Self::Control(u8::try_from(number - CONTROL).ok()?)
            }
            Token(number) if number % 2 == 0 => Self::Endpoint(u16::try_from(number / 2 - 2).ok()?),
            Token(number) => Self::Link(LinkId::new(number.checked_sub(5)? / 2)?),
        })
    }
}
