//! Metrics: the text that Prometheus reads, made of a [`Snapshot`].
//!
//! Labels are endpoints and components, never links or peers: what strangers can make many of adds
//! no series. Counters never fall, though links come and go.

mod components;
mod families;

use std::fmt::Write;

use prometheus_client::encoding::text::encode;
use prometheus_client::registry::Registry;

use self::components::ComponentCounts;
use self::families::Picture;
use super::Snapshot;

/// How many components have series of their own; of the others there is the number alone.
pub const MAX_COMPONENT_SERIES: usize = 256;

/// Which text a reader of metrics understands.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MetricsFormat {
    /// OpenMetrics 1.0.
    OpenMetrics,
    /// What Prometheus read before there was OpenMetrics, and still reads.
    Plain,
}

impl MetricsFormat {
    /// What a request with this `Accept` is answered with: OpenMetrics where it is asked for.
    pub fn accepted(accept: &str) -> Self {
        let is_asked = |kind: &str| kind.trim_start().starts_with("application/openmetrics-text");
        if accept.split(',').any(is_asked) { Self::OpenMetrics } else { Self::Plain }
    }

    /// The `Content-Type`.
    pub fn content_type(self) -> &'static str {
        match self {
            Self::OpenMetrics => "application/openmetrics-text; version=1.0.0; charset=utf-8",
            Self::Plain => "text/plain; version=0.0.4; charset=utf-8",
        }
    }
}

/// Makes metrics of snapshots, and remembers what the counters of components must not fall below.
#[derive(Debug, Default)]
pub struct Metrics {
    components: ComponentCounts,
}

impl Metrics {
    /// The text for a snapshot, which is later than all those before it.
    pub fn encode(&mut self, snapshot: Snapshot, format: MetricsFormat) -> String {
        self.components.handle(&snapshot);
        let picture = Picture::new(snapshot, self.components.series());
        let mut registry = Registry::with_prefix("mavswitch");
        registry.register_collector(Box::new(picture));
        let mut text = String::new();
        // A string takes whatever is written to it.
        let _ = encode(&mut text, &registry);
        match format {
            MetricsFormat::OpenMetrics => text,
            MetricsFormat::Plain => to_plain(&text),
        }
    }
}

/// The older text: there a counter is called as its samples are, and neither units nor the end are
/// told.
fn to_plain(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if let Some((name, help)) = line.strip_prefix("# HELP ").and_then(|it| it.split_once(' ')) {
            let kind = lines.next_if(|next| next.starts_with("# TYPE "));
            let kind = kind.and_then(|line| line.rsplit(' ').next()).unwrap_or("untyped");
            let suffix = if kind == "counter" { "_total" } else { "" };
            let _ = writeln!(plain, "# HELP {name}{suffix} {help}\n# TYPE {name}{suffix} {kind}");
        } else if !line.starts_with("# UNIT ") && line != "# EOF" {
            plain.push_str(line);
            plain.push('\n');
        }
    }
    plain
}

#[cfg(test)]
mod tests;
