//! Judges frames by their checksum: whole, damaged, or made with a definition nobody told us.
//!
//! A frame of a known (id, CRC_EXTRA) pair is checked in full. Any other frame is explained by at
//! most one CRC_EXTRA (rule 23); the second frame that agrees on it confirms the pair, and from
//! then on the pair is checked in full as well. What was seen is kept in a bounded table.

use super::crc::{Crc, implied_extra};
use super::dialect::{Dialect, Target};
use super::frame::Frame;
use super::id::{Component, MessageId};

/// What the checksum says of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// Whole: a known definition explains it, and tells where the target is.
    Known(Target),
    /// Whole: made with a pair that earlier frames have confirmed. Its target cannot be read.
    Confirmed,
    /// Explained by a CRC_EXTRA that was not confirmed yet; see [`Checker::remember`].
    Unconfirmed(Sighting),
    /// No CRC_EXTRA explains it.
    Damaged,
}

/// A pair of (id, CRC_EXTRA) that would explain a frame, and how much speaks for it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Sighting {
    pair: Pair,
    evidence: Evidence,
}

/// How much speaks for an unconfirmed pair.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Evidence {
    /// The first frame of an unknown id: passed on as a broadcast, and nothing learned (rule 22).
    First,
    /// Agrees with an earlier frame: the pair is confirmed with this one (rules 23 and 26).
    Second,
    /// The first frame that contradicts what is known of its id: held for damaged (rule 26).
    Contradiction,
}

/// What a pair is remembered by.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Pair {
    id: MessageId,
    crc_extra: u8,
    /// For ids that have definitions, frames must agree on the source too (rule 26).
    source: Option<Component>,
}

/// The message table, and what the traffic has taught beyond it.
#[derive(Clone, Debug)]
pub struct Checker {
    dialect: Dialect,
    confirmed: Recent<Pair>,
    sighted: Recent<Pair>,
}

impl Checker {
    /// Judges by the definitions of `dialect`.
    pub fn new(dialect: Dialect) -> Self {
        Self { dialect, confirmed: Recent::new(), sighted: Recent::new() }
    }

    /// Judges by other definitions from now on. What the traffic has taught stays.
    pub fn set_dialect(&mut self, dialect: Dialect) {
        self.dialect = dialect;
    }

    /// The definitions this checker judges by.
    pub fn dialect(&self) -> &Dialect {
        &self.dialect
    }

    /// Judges a frame and changes nothing: the same frame may be judged again.
    #[inline]
    pub fn check(&self, frame: &Frame<'_>) -> Verdict {
        let crc = Crc::of(frame.checked_bytes());
        let Some(crc_extra) = implied_extra(crc, frame.checksum()) else {
            return Verdict::Damaged;
        };
        match self.dialect.by_pair(frame.header().id, crc_extra) {
            Some(definition) => Verdict::Known(definition.target),
            None => self.check_unknown(frame, crc_extra),
        }
    }

    fn check_unknown(&self, frame: &Frame<'_>, crc_extra: u8) -> Verdict {
        let header = frame.header();
        let has_definition = self.dialect.by_id(header.id).is_some();
        let source = has_definition.then_some(header.source);
        let pair = Pair { id: header.id, crc_extra, source };
        if self.confirmed.contains(&pair) {
            return Verdict::Confirmed;
        }
        let evidence = if self.sighted.contains(&pair) {
            Evidence::Second
        } else if has_definition || self.confirmed.any(|known| known.id == pair.id) {
            Evidence::Contradiction
        } else {
            Evidence::First
        };
        Verdict::Unconfirmed(Sighting { pair, evidence })
    }

    /// Takes a sighting as evidence for later frames, and says what it is evidence of.
    pub fn remember(&mut self, sighting: Sighting) -> Evidence {
        if sighting.evidence == Evidence::Second {
            self.confirmed.insert(sighting.pair);
        } else {
            self.sighted.insert(sighting.pair);
        }
        sighting.evidence
    }
}

/// The last [`REMEMBERED`] values of a kind; a new one takes the place of the oldest.
#[derive(Clone, Debug)]
struct Recent<T> {
    values: Vec<T>,
    oldest: usize,
}

/// How many pairs are remembered, of the confirmed and of the sighted each.
const REMEMBERED: usize = 256;

impl<T: PartialEq> Recent<T> {
    fn new() -> Self {
        Self { values: Vec::with_capacity(REMEMBERED), oldest: 0 }
    }

    fn contains(&self, value: &T) -> bool {
        self.values.contains(value)
    }

    fn any(&self, predicate: impl FnMut(&T) -> bool) -> bool {
        self.values.iter().any(predicate)
    }

    fn insert(&mut self, value: T) {
        if self.values.len() < REMEMBERED {
            self.values.push(value);
        } else {
            self.values[self.oldest] = value;
            self.oldest = (self.oldest + 1) % REMEMBERED;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::encode::FrameSpec;
    use super::*;

    fn frame(id: u32, crc_extra: u8, source: Component) -> Vec<u8> {
        FrameSpec::new(source, MessageId(id), crc_extra, &[1, 2, 3]).to_frame()
    }

    /// Judges a frame as the splitter does, remembering what is worth it.
    fn judge(checker: &mut Checker, bytes: &[u8]) -> Verdict {
        let verdict = checker.check(&Frame::parse(bytes).unwrap());
        if let Verdict::Unconfirmed(sighting) = verdict {
            checker.remember(sighting);
        }
        verdict
    }

    fn evidence(verdict: Verdict) -> Option<Evidence> {
        match verdict {
            Verdict::Unconfirmed(sighting) => Some(sighting.evidence),
            _ => None,
        }
    }

    const VEHICLE: Component = Component::new(1, 1);

    #[test]
    fn rule_23_the_second_agreeing_frame_confirms_an_unknown_id() {
        let mut checker = Checker::new(Dialect::builtin());
        let unknown = frame(54_321, 77, VEHICLE);
        assert_eq!(evidence(judge(&mut checker, &unknown)), Some(Evidence::First));
        assert_eq!(evidence(judge(&mut checker, &unknown)), Some(Evidence::Second));
        assert_eq!(judge(&mut checker, &unknown), Verdict::Confirmed);
    }

    #[test]
    fn rule_23_a_confirmed_id_is_checked_in_full() {
        let mut checker = Checker::new(Dialect::builtin());
        let unknown = frame(54_321, 77, VEHICLE);
        judge(&mut checker, &unknown);
        judge(&mut checker, &unknown);
        let other = frame(54_321, 78, VEHICLE);
        assert_eq!(evidence(judge(&mut checker, &other)), Some(Evidence::Contradiction));
        let mut damaged = unknown;
        for bit in 0..8 {
            damaged[10] ^= 1 << bit;
            let verdict = judge(&mut checker, &damaged);
            assert_ne!(evidence(verdict), Some(Evidence::First));
            assert_ne!(verdict, Verdict::Confirmed);
            damaged[10] ^= 1 << bit;
        }
    }

    #[test]
    fn rule_26_a_strange_definition_of_a_known_id_needs_two_frames_of_one_source() {
        let mut checker = Checker::new(Dialect::builtin());
        let strange = frame(0, 51, VEHICLE);
        assert_eq!(evidence(judge(&mut checker, &strange)), Some(Evidence::Contradiction));
        let elsewhere = frame(0, 51, Component::new(2, 1));
        assert_eq!(evidence(judge(&mut checker, &elsewhere)), Some(Evidence::Contradiction));
        assert_eq!(evidence(judge(&mut checker, &strange)), Some(Evidence::Second));
        assert_eq!(judge(&mut checker, &strange), Verdict::Confirmed);
    }

    #[test]
    fn what_is_remembered_is_bounded() {
        let mut checker = Checker::new(Dialect::builtin());
        for id in 0..10_000 {
            judge(&mut checker, &frame(1_000_000 + id, 1, VEHICLE));
        }
        assert_eq!(checker.sighted.values.len(), REMEMBERED);
        let newest = frame(1_009_999, 1, VEHICLE);
        assert_eq!(evidence(judge(&mut checker, &newest)), Some(Evidence::Second));
    }
}
