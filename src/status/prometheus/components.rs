//! What each component's frames add up to, also when a link on which it was heard is gone.

use std::collections::BTreeMap;

use super::MAX_COMPONENT_SERIES;
use crate::status::{HeardStatus, Snapshot};

/// System, component and endpoint: the labels of a series.
pub(super) type Key = (u8, u8, String);

/// The counts of one series.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Counts {
    /// Frames that came.
    pub(super) frames: u64,
    /// Frames that were lost.
    pub(super) lost: u64,
}

/// A series, and how far its links were when they were last seen.
#[derive(Debug, Default)]
struct Series {
    total: Counts,
    links: BTreeMap<u16, Counts>,
}

/// The series of components. Invariant: of at most [`MAX_COMPONENT_SERIES`] components.
#[derive(Debug, Default)]
pub(super) struct ComponentCounts {
    series: BTreeMap<Key, Series>,
}

impl ComponentCounts {
    /// Adds what came since the snapshot before. Components that are not known any more make room.
    pub(super) fn handle(&mut self, snapshot: &Snapshot) {
        let known = snapshot.components.iter().take(MAX_COMPONENT_SERIES);
        let known: BTreeMap<_, _> =
            known.map(|it| ((it.system, it.component), &it.heard)).collect();
        let is_endpoint = |name: &str| snapshot.endpoints.iter().any(|it| it.name == name);
        self.series.retain(|(system, component, endpoint), _| {
            known.contains_key(&(*system, *component)) && is_endpoint(endpoint)
        });
        for ((system, component), heard) in known {
            self.add(system, component, heard);
        }
    }

    fn add(&mut self, system: u8, component: u8, heard: &[HeardStatus]) {
        for series in self.of(system, component) {
            series.links.retain(|link, _| heard.iter().any(|it| it.link == *link));
        }
        for HeardStatus { endpoint, link, frames, lost, .. } in heard {
            let series = self.series.entry((system, component, endpoint.clone())).or_default();
            let now = Counts { frames: *frames, lost: *lost };
            let before = series.links.insert(*link, now).unwrap_or_default();
            // Another link may have got the number of one that is gone; it began at nothing.
            let before = if before.frames > now.frames { Counts::default() } else { before };
            series.total.frames += now.frames - before.frames;
            series.total.lost += now.lost.saturating_sub(before.lost);
        }
    }

    fn of(&mut self, system: u8, component: u8) -> impl Iterator<Item = &mut Series> {
        let first = (system, component, String::new());
        let of = self.series.range_mut(first..);
        of.take_while(move |((s, c, _), _)| (*s, *c) == (system, component)).map(|(_, it)| it)
    }

    /// All of them, in order.
    pub(super) fn series(&self) -> Vec<(Key, Counts)> {
        self.series.iter().map(|(key, series)| (key.clone(), series.total)).collect()
    }
}
