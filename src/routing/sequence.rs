//! Loss by sequence numbers: per source and link, at reception, before any filter (rule 51).

/// What the sequence numbers of one component on one link tell.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct Sequence {
    /// The newest, by which gaps are counted.
    last: Option<u8>,
    /// That of the frame that came last, newest or not.
    latest: u8,
    /// Whether two frames that followed each other had different ones.
    counts: bool,
    /// Frames received.
    pub received: u64,
    /// Frames that were sent before the last one received and did not arrive.
    pub lost: u64,
}

impl Sequence {
    /// The number of the frame that came last: a sender that started again is found by it at once.
    pub(super) fn latest(&self) -> u8 {
        self.latest
    }

    /// Whether the source is known to count: there are senders that never do.
    pub(super) fn counts(&self) -> bool {
        self.counts
    }

    /// Takes the next frame's sequence number into account; says how many frames are missing
    /// before it.
    pub fn handle(&mut self, seq: u8) -> u8 {
        self.received += 1;
        let previous = std::mem::replace(&mut self.latest, seq);
        let Some(last) = self.last else {
            self.last = Some(seq);
            return 0;
        };
        self.counts |= previous != seq;
        let gap = seq.wrapping_sub(last).wrapping_sub(1);
        // The other half of the circle: late, a duplicate, or a sender that started again.
        if gap >= 128 {
            return 0;
        }
        self.lost += u64::from(gap);
        self.last = Some(seq);
        gap
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lost(numbers: &[u8]) -> u64 {
        let mut sequence = Sequence::default();
        let gaps: u64 = numbers.iter().map(|seq| u64::from(sequence.handle(*seq))).sum();
        assert_eq!(gaps, sequence.lost);
        assert_eq!(sequence.received, numbers.len() as u64);
        sequence.lost
    }

    #[test]
    fn rule_51_gaps_are_counted_over_the_wrap() {
        assert_eq!(lost(&[254, 255, 0, 1]), 0);
        assert_eq!(lost(&[254, 1]), 2);
        assert_eq!(lost(&[7, 7 + 128]), 127);
    }

    #[test]
    fn rule_51_late_and_repeated_frames_are_no_loss_and_do_not_step_back() {
        assert_eq!(lost(&[10, 11, 11, 9, 12]), 0);
        assert_eq!(lost(&[10, 12, 11, 13]), 1);
        assert_eq!(lost(&[200, 0, 201]), 55);
    }

    #[test]
    fn rule_51_the_first_frame_of_a_source_is_no_gap() {
        assert_eq!(lost(&[200]), 0);
    }
}
