//! The metrics one by one: their names, what they mean, and where in the snapshot they stand.
//!
//! Names and units follow the conventions of Prometheus: base units, and what a counter counts in
//! its name; the library adds `_total`.

use std::collections::BTreeMap;
use std::fmt::Error;

use prometheus_client::collector::Collector;
use prometheus_client::encoding::{
    DescriptorEncoder, EncodeGaugeValue, EncodeLabel, EncodeLabelSet, LabelSetEncoder, NoLabelSet,
};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::exemplar::Exemplar;
use prometheus_client::registry::Unit;

use super::MAX_COMPONENT_SERIES;
use super::components::{Counts, Key};
use crate::status::{
    ArmedState, ComponentStatus, Counters, EndpointState, EndpointStatus, Snapshot,
};

/// What one scrape is made of.
#[derive(Debug)]
pub(super) struct Picture {
    snapshot: Snapshot,
    /// For each endpoint, what its links counted, with those that are gone.
    totals: Vec<Counters>,
    components: Vec<(Key, Counts)>,
}

/// A metric: its name and unit, and what it means.
struct Family(&'static str, Option<Unit>, &'static str);

type CounterOf = (Family, fn(&Counters) -> u64);
type CountOf = (Family, fn(&Counts) -> u64);
type GaugeOf = (Family, fn(&EndpointStatus) -> f64);

impl Picture {
    pub(super) fn new(snapshot: Snapshot, components: Vec<(Key, Counts)>) -> Self {
        let totals = snapshot.endpoints.iter().map(total).collect();
        Self { snapshot, totals, components }
    }

    fn program(&self, encoder: &mut DescriptorEncoder<'_>) -> Result<(), Error> {
        let version = self.snapshot.program.version.as_str();
        let build = Family("build_info", None, "The version that runs; always 1");
        gauges(encoder, &build, [([("version", version)], 1u64)])?;
        let uptime = Family("uptime", Some(Unit::Seconds), "How long the program has run");
        gauge(encoder, &uptime, &(self.snapshot.time_us as f64 / 1e6))
    }

    fn endpoint_counters(&self, encoder: &mut DescriptorEncoder<'_>) -> Result<(), Error> {
        for (family, value) in endpoint_counters() {
            let totals = self.endpoints().map(|(name, _, total)| (endpoint(name), value(total)));
            counters(encoder, &family, totals)?;
        }
        let reconnects = Family("reconnects", None, "How often a link or socket was opened again");
        let each = self.endpoints().map(|(name, it, _)| (endpoint(name), it.reconnects));
        counters(encoder, &reconnects, each)
    }

    fn refused(&self, encoder: &mut DescriptorEncoder<'_>) -> Result<(), Error> {
        let family = Family("refused_frames", None, "Frames that were refused, by reason");
        let each = self.endpoints().flat_map(|(name, _, total)| {
            let labels = move |reason| [("endpoint", name), ("reason", reason)];
            total.refused.iter().map(move |(reason, count)| (labels(reason.as_str()), *count))
        });
        counters(encoder, &family, each)
    }

    fn refused_peers(&self, encoder: &mut DescriptorEncoder<'_>) -> Result<(), Error> {
        let help = "Connections and datagrams of those who were refused as peers, by reason";
        let each = self.endpoints().flat_map(|(name, endpoint, _)| {
            let labels = move |reason| [("endpoint", name), ("reason", reason)];
            endpoint.refused_peers.iter().map(move |(why, count)| (labels(why.as_str()), *count))
        });
        counters(encoder, &Family("refused_peers", None, help), each)
    }

    fn endpoint_gauges(&self, encoder: &mut DescriptorEncoder<'_>) -> Result<(), Error> {
        for (family, value) in endpoint_gauges() {
            let each = self.endpoints().map(|(name, it, _)| (endpoint(name), value(it)));
            gauges(encoder, &family, each)?;
        }
        let help = "The worst loss of late among the links of an endpoint, 0 to 1, if it is known";
        let each = self.endpoints();
        let each = each.filter_map(|(name, it, _)| Some((endpoint(name), worst_loss(it)?)));
        gauges(encoder, &Family("loss_ratio", None, help), each)?;
        let help = "The longest round trip of late among the links of an endpoint, if it is known";
        let each = self.endpoints();
        let each = each.filter_map(|(name, it, _)| Some((endpoint(name), longest_trip(it)?)));
        gauges(encoder, &Family("round_trip", Some(Unit::Seconds), help), each)
    }

    fn component_counters(&self, encoder: &mut DescriptorEncoder<'_>) -> Result<(), Error> {
        let families: [CountOf; 2] = [
            (Family("component_frames", None, "Frames heard of a component"), |it| it.frames),
            (Family("component_lost_frames", None, "Frames lost, by the sequence numbers"), |it| {
                it.lost
            }),
        ];
        for (family, value) in families {
            let each = self.components.iter().map(|((system, component, endpoint), counts)| {
                let (system, component) = (u64::from(*system), u64::from(*component));
                (ComponentLabels { system, component, endpoint: Some(endpoint) }, value(counts))
            });
            counters(encoder, &family, each)?;
        }
        Ok(())
    }

    fn component_gauges(&self, encoder: &mut DescriptorEncoder<'_>) -> Result<(), Error> {
        let shown = || self.snapshot.components.iter().take(MAX_COMPONENT_SERIES);
        let silence = Family("component_silence", Some(Unit::Seconds), "Since it was last heard");
        let each = shown().filter_map(|it| {
            let silence = it.heard.iter().map(|heard| heard.heard_ago_ms).min()?;
            Some((component(it), silence as f64 / 1e3))
        });
        gauges(encoder, &silence, each)?;
        let armed = Family("component_armed", None, "Whether it is armed, if it can be");
        gauges(encoder, &armed, shown().filter_map(|it| Some((component(it), armed_value(it)?))))?;
        let known = self.snapshot.components.len();
        let all = Family("components", None, "How many components are known");
        gauge(encoder, &all, &(known as u64))?;
        let others = known.saturating_sub(MAX_COMPONENT_SERIES) as u64;
        let left_out =
            Family("components_left_out", None, "Components without series of their own");
        gauge(encoder, &left_out, &others)
    }

    fn endpoints(&self) -> impl Iterator<Item = (&str, &EndpointStatus, &Counters)> {
        let each = self.snapshot.endpoints.iter().zip(&self.totals);
        each.map(|(endpoint, total)| (endpoint.name.as_str(), endpoint, total))
    }
}

impl Collector for Picture {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> Result<(), Error> {
        self.program(&mut encoder)?;
        self.endpoint_counters(&mut encoder)?;
        self.refused(&mut encoder)?;
        self.refused_peers(&mut encoder)?;
        self.endpoint_gauges(&mut encoder)?;
        self.component_counters(&mut encoder)?;
        self.component_gauges(&mut encoder)
    }
}

/// The labels of a component.
#[derive(Clone, Debug)]
struct ComponentLabels<'a> {
    system: u64,
    component: u64,
    endpoint: Option<&'a str>,
}

impl EncodeLabelSet for ComponentLabels<'_> {
    fn encode(&self, encoder: &mut LabelSetEncoder<'_>) -> Result<(), Error> {
        ("system", self.system).encode(encoder.encode_label())?;
        ("component", self.component).encode(encoder.encode_label())?;
        self.endpoint.map_or(Ok(()), |it| ("endpoint", it).encode(encoder.encode_label()))
    }
}

fn endpoint(name: &str) -> [(&'static str, &str); 1] {
    [("endpoint", name)]
}

fn component(of: &ComponentStatus) -> ComponentLabels<'static> {
    let (system, component) = (u64::from(of.system), u64::from(of.component));
    ComponentLabels { system, component, endpoint: None }
}

fn endpoint_counters() -> [CounterOf; 7] {
    let bytes = || Some(Unit::Bytes);
    [
        (Family("received_frames", None, "Frames that arrived whole"), |it| it.frames_in),
        (Family("received", bytes(), "Bytes of frames that arrived whole"), |it| it.bytes_in),
        (Family("sent_frames", None, "Frames queued for sending"), |it| it.frames_out),
        (Family("sent", bytes(), "Bytes of frames queued for sending"), |it| it.bytes_out),
        (Family("garbage", bytes(), "Bytes received that belong to no frame"), |it| {
            it.garbage_bytes
        }),
        (Family("bad_checksum_frames", None, "Frames with a wrong checksum"), |it| it.bad_crc),
        (
            Family("unknown_flag_frames", None, "Frames with an unknown flag that forbids them"),
            |it| it.unknown_flags,
        ),
    ]
}

fn endpoint_gauges() -> [GaugeOf; 5] {
    [
        (Family("endpoint_up", None, "Whether an endpoint is open: 1 or 0"), |it| {
            let is_up = matches!(it.state, EndpointState::Up | EndpointState::Listening);
            f64::from(u8::from(is_up))
        }),
        (Family("endpoint_links", None, "Live links of an endpoint"), |it| it.links.len() as f64),
        (Family("queue", Some(Unit::Bytes), "Bytes that wait to be sent"), |it| {
            it.links.iter().map(|link| link.queue.bytes).sum::<u64>() as f64
        }),
        (Family("queue_limit", Some(Unit::Bytes), "Bytes that may wait at most"), |it| {
            it.links.iter().map(|link| link.queue.limit).sum::<u64>() as f64
        }),
        (
            Family("queue_age", Some(Unit::Seconds), "How long the oldest waiting frame waits"),
            |it| it.links.iter().map(|link| link.queue.age_ms).max().unwrap_or(0) as f64 / 1e3,
        ),
    ]
}

/// What an endpoint counted since it is there: links that are gone count on.
fn total(endpoint: &EndpointStatus) -> Counters {
    let mut refused: BTreeMap<String, u64> = BTreeMap::new();
    let mut sum = Counters::default();
    let links = endpoint.links.iter().map(|link| &link.counters);
    for counters in links.chain([&endpoint.past]) {
        sum.frames_in += counters.frames_in;
        sum.bytes_in += counters.bytes_in;
        sum.frames_out += counters.frames_out;
        sum.bytes_out += counters.bytes_out;
        sum.garbage_bytes += counters.garbage_bytes;
        sum.bad_crc += counters.bad_crc;
        sum.unknown_flags += counters.unknown_flags;
        for (reason, count) in &counters.refused {
            *refused.entry(reason.clone()).or_default() += count;
        }
    }
    sum.refused = refused;
    sum
}

fn worst_loss(endpoint: &EndpointStatus) -> Option<f64> {
    let losses = endpoint.links.iter().filter_map(|link| link.loss_percent);
    losses.max_by(f64::total_cmp).map(|percent| percent / 100.0)
}

fn longest_trip(endpoint: &EndpointStatus) -> Option<f64> {
    let trips = endpoint.links.iter().filter_map(|link| link.round_trip_ms);
    trips.max_by(f64::total_cmp).map(|ms| ms / 1e3)
}

fn armed_value(component: &ComponentStatus) -> Option<u64> {
    match component.vehicle.as_ref()?.armed {
        ArmedState::Armed => Some(1),
        ArmedState::Disarmed => Some(0),
        ArmedState::None => None,
    }
}

fn counters<L: EncodeLabelSet>(
    encoder: &mut DescriptorEncoder<'_>,
    Family(name, unit, help): &Family,
    samples: impl IntoIterator<Item = (L, u64)>,
) -> Result<(), Error> {
    let none = None::<&Exemplar<NoLabelSet, u64>>;
    let mut metric = encoder.encode_descriptor(name, help, unit.as_ref(), MetricType::Counter)?;
    for (labels, value) in samples {
        metric.encode_family(&labels)?.encode_counter(&value, none)?;
    }
    Ok(())
}

fn gauges<L: EncodeLabelSet, V: EncodeGaugeValue>(
    encoder: &mut DescriptorEncoder<'_>,
    Family(name, unit, help): &Family,
    samples: impl IntoIterator<Item = (L, V)>,
) -> Result<(), Error> {
    let mut metric = encoder.encode_descriptor(name, help, unit.as_ref(), MetricType::Gauge)?;
    for (labels, value) in samples {
        metric.encode_family(&labels)?.encode_gauge(&value)?;
    }
    Ok(())
}

fn gauge(
    encoder: &mut DescriptorEncoder<'_>,
    Family(name, unit, help): &Family,
    value: &impl EncodeGaugeValue,
) -> Result<(), Error> {
    let gauge = MetricType::Gauge;
    encoder.encode_descriptor(name, help, unit.as_ref(), gauge)?.encode_gauge(value)
}
