//! Two components, a pause, a loss, and a clock that steps back.

use super::*;
use crate::mavlink::FrameSpec;

const START: u64 = 1_700_000_000_000_000;

fn read(records: &[(u64, u8, u8, u32)]) -> Info {
    let mut log = Vec::new();
    for (millis, component, seq, id) in records {
        log.extend((START + millis * 1_000).to_be_bytes());
        let extra = if *id == 0 { 50 } else { 39 };
        let source = Component::new(1, *component);
        let spec = FrameSpec::new(source, MessageId(*id), extra, &[1; 9]);
        log.extend(FrameSpec { seq: *seq, ..spec }.to_frame());
    }
    Info::read(TlogReader::new(&log[..]), |_| {}).unwrap()
}

#[test]
fn duration_rates_losses_and_pauses_are_told() {
    let records =
        [(0, 1, 7, 0), (500, 1, 8, 30), (1_000, 2, 0, 0), (4_000, 1, 11, 30), (3_000, 1, 12, 30)];
    let info = read(&records);
    assert_eq!(info.duration(), Duration::from_secs(4));
    assert_eq!(info.components[&Component::new(1, 1)].lost, 2);
    assert_eq!(info.components[&Component::new(1, 2)].received, 1);
    assert_eq!(info.messages[&MessageId(30)], 3);
    assert_eq!((info.gap_count, info.steps_back), (1, 1));
    let gap = Gap { at: START + 1_000_000, duration: Duration::from_secs(3) };
    assert_eq!(info.gaps, [gap]);
    let text = info.told(&Dialect::builtin()).to_string();
    for words in
        ["2023-11-14T22:13:20.000Z", "duration  4s", "5 (1.2 a second)", "ATTITUDE", "left out"]
    {
        assert!(text.contains(words), "no `{words}` in:\n{text}");
    }
}

#[test]
fn only_the_longest_pauses_are_kept() {
    let records: Vec<_> = (0..100_u64).map(|n| (n * n * 2_000, 1, n as u8, 0)).collect();
    let info = read(&records);
    assert_eq!((info.gap_count, info.gaps.len()), (99, LISTED));
    assert_eq!(info.gaps[9].duration, Duration::from_secs(2 * (99 * 99 - 98 * 98)));
    assert!(info.gaps.is_sorted_by_key(|gap| gap.at));
}
