//! The words for [`Why`]: the verdict first, then a line for each link, and what to do about it.

use std::fmt::Write;

use super::diagnosis::{Finding, diagnose};
use super::snapshot::Snapshot;
use super::why::{FrameFate, LinkFate, Why};
use crate::printable::printable;

impl Why {
    /// For people; `snapshot` tells who was heard instead, and what else looks wrong.
    pub fn to_text(&self, snapshot: &Snapshot) -> String {
        let mut text = String::new();
        for frame in &self.frames {
            frame.write(&mut text);
        }
        if !self.from_is_known {
            text += &unheard(&self.from, snapshot);
        }
        if !self.to_is_known && self.to != self.from {
            text += &unheard(&self.to, snapshot);
        }
        let is_right = self.from_is_known && self.to_is_known;
        if !is_right || !self.frames.iter().all(FrameFate::arrives) {
            write_findings(&mut text, &diagnose(snapshot));
        }
        text
    }
}

/// A general diagnosis, for people.
pub fn diagnosis_text(snapshot: &Snapshot) -> String {
    let findings = diagnose(snapshot);
    let mut text = String::new();
    if findings.is_empty() {
        let components = snapshot.components.len();
        let links: usize = snapshot.endpoints.iter().map(|endpoint| endpoint.links.len()).sum();
        // To a string, this cannot fail; the same below.
        let _ = writeln!(text, "nothing looks wrong: {components} components on {links} links");
    }
    write_findings(&mut text, &findings);
    text
}

fn write_findings(text: &mut String, findings: &[Finding]) {
    for Finding { endpoint, problem, remedy } in findings {
        let place = endpoint.as_ref().map_or_else(String::new, |name| format!("{name}: "));
        let _ = writeln!(text, "{}{}", printable(&place), printable(problem));
        let _ = writeln!(text, "    {remedy}");
    }
}

fn unheard(name: &str, snapshot: &Snapshot) -> String {
    let mut heard: Vec<String> = Vec::new();
    for component in &snapshot.components {
        let mut places: Vec<&str> = component.heard.iter().map(|it| it.endpoint.as_str()).collect();
        places.dedup();
        let (system, id) = (component.system, component.component);
        heard.push(format!("{system}/{id} on {}", printable(&places.join(", "))));
    }
    let more = heard.len().saturating_sub(12);
    heard.truncate(12);
    if more > 0 {
        heard.push(format!("and {more} more"));
    }
    if heard.is_empty() {
        return format!("{name} was never heard, nor was anybody else\n");
    }
    format!("{name} was never heard; heard were {}\n", heard.join("; "))
}

impl FrameFate {
    fn write(&self, text: &mut String) {
        let Self { source, target, message, .. } = self;
        let head = format!("{source} -> {target} {message}");
        let from = place(&self.endpoint, &self.peer);
        let sent: Vec<String> = self.links.iter().filter(|it| it.is_sent).map(described).collect();
        let condition = if self.if_signature_is_good { ", if its signature is good" } else { "" };
        let _ = match (&self.refused, sent.is_empty()) {
            (Some(reason), _) => {
                let (why, remedy) = words(reason);
                writeln!(text, "{head}: not taken from {from}: {why}\n    {remedy}")
            }
            (None, true) => writeln!(text, "{head}: from {from} to nobody{condition}"),
            (None, false) => {
                writeln!(text, "{head}: from {from} to {}{condition}", sent.join(", "))
            }
        };
        if self.refused.is_some() {
            return;
        }
        for link in self.links.iter().filter(|link| !link.is_sent && link.reason != "own_link") {
            let (why, remedy) = words(&link.reason);
            let by = link.by.as_ref().map_or_else(String::new, |by| format!(" (by {by})"));
            let place = place(&link.endpoint, &link.peer);
            let _ = writeln!(text, "  not to {place}: {why}{by}");
            if link.is_wanted && !remedy.is_empty() {
                let _ = writeln!(text, "      {remedy}");
            }
        }
    }
}

fn described(link: &LinkFate) -> String {
    let why = match link.reason.as_str() {
        "same_group" => " (same group as where it was heard)",
        "sniffer" => " (sent everything)",
        _ => "",
    };
    format!("{}{why}", place(&link.endpoint, &link.peer))
}

fn place(endpoint: &str, peer: &str) -> String {
    if peer.is_empty() || peer == endpoint {
        printable(endpoint)
    } else {
        printable(&format!("{endpoint} ({peer})"))
    }
}

/// What a reason means, and what to do about it, if there is anything to be done.
fn words(reason: &str) -> (&str, &str) {
    match reason {
        "own_group" => ("it leads the same way as where the frame came from (one group)", ""),
        "unheard" => (
            "the target was never heard there",
            "does it send anything there? `mavswitch listen from=NAME` shows what comes",
        ),
        "stale" => (
            "the target was heard there, but too long ago",
            "it must send something again, or set --route-age 0 to remember it for ever",
        ),
        "not_learned" => (
            "the target was heard there, but nothing that came there teaches a route",
            "with --learn heartbeat only HEARTBEAT does; copies of what came elsewhere never do",
        ),
        "others_only" => (
            "others of the target's system are there, but not the target itself",
            "ask for the whole system (component 0), or leave out --strict if it never speaks",
        ),
        "other_path" => (
            "its group has chosen another path",
            "the group's `select` decides which paths are used",
        ),
        "loop" => (
            "a broadcast of the source just came from there, so whoever is there has it",
            "if those are two cables to one place, put both endpoints into one `group`",
        ),
        "filtered_in" => (
            "its lists of what comes in do not let it",
            "see allow_*_in and block_*_in of this endpoint",
        ),
        "filtered_out" => (
            "its lists of what goes out do not let it",
            "see allow_*_out and block_*_out of this endpoint",
        ),
        "setup_signing" => (
            "SETUP_SIGNING carries a secret key and is kept where it is",
            "set forward_setup_signing on both endpoints to let it pass",
        ),
        "queue_full" => (
            "its queue is full: the line carries less than it is sent",
            "send it less: a faster line, `rate` caps, or lists of what goes out",
        ),
        "readonly" => (
            "nothing is taken from this endpoint (readonly)",
            "leave out `readonly` if whoever is there shall be heard",
        ),
        "max_rate" => (
            "too many frames come from there in a second (max_rate)",
            "raise `max_rate`, or find out who floods: `mavswitch listen from=NAME`",
        ),
        "stream_request" => (
            "it asks for telemetry, which nobody there may do (block_stream_requests)",
            "leave out `block_stream_requests`, or set `request_streams` where the vehicle is",
        ),
        "unsigned" => (
            "it is not signed, and `verify` asks for that",
            "switch signing on there with the same key, or name the message in allow_unsigned",
        ),
        "unproven" => (
            "whoever is there has sent nothing yet that is signed with the key of `verify`",
            "it must speak first, and sign: a ground station sends heartbeats by itself",
        ),
        "unsignable" => (
            "MAVLink 1 cannot be signed, and is not sent there (v1 = drop)",
            "v1 = upgrade makes it MAVLink 2 and signs it",
        ),
        "signed" => (
            "it would need other system ids (remap), and its signature does not allow that",
            "take signatures off where it comes in: `verify` and `strip`",
        ),
        "not_converted" => (
            "it cannot be had in the version of MAVLink that is sent there",
            "version_strict = false sends it as it is",
        ),
        "rate_cap" => ("its cap on this message has let one through just now", ""),
        _ => (reason, ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::{ComponentStatus, HeardStatus};

    fn link(endpoint: &str, reason: &str, is_sent: bool) -> LinkFate {
        let (endpoint, reason) = (endpoint.to_owned(), reason.to_owned());
        LinkFate { endpoint, reason, is_sent, ..LinkFate::default() }
    }

    fn frame(links: Vec<LinkFate>) -> FrameFate {
        FrameFate {
            source: "255/190".to_owned(),
            target: "1/1".to_owned(),
            message: "PARAM_SET".to_owned(),
            endpoint: "gcs".to_owned(),
            peer: "10.0.0.2:14550".to_owned(),
            links,
            ..FrameFate::default()
        }
    }

    fn told(frames: Vec<FrameFate>) -> String {
        let (from, to) = ("255/190".to_owned(), "1/1".to_owned());
        let why = Why { from, to, from_is_known: true, to_is_known: true, frames };
        why.to_text(&Snapshot::default())
    }

    #[test]
    fn the_verdict_comes_first_and_then_a_line_for_each_other_link() {
        let mut full = link("radio", "queue_full", false);
        full.is_wanted = true;
        let links = vec![link("gcs", "own_link", false), link("fc", "route", true), full];
        assert_eq!(
            told(vec![frame(links)]),
            "255/190 -> 1/1 PARAM_SET: from gcs (10.0.0.2:14550) to fc\n  \
               not to radio: its queue is full: the line carries less than it is sent\n      \
                   send it less: a faster line, `rate` caps, or lists of what goes out\n"
        );
    }

    #[test]
    fn what_is_not_taken_at_all_is_told_where_it_comes_in() {
        let refused = Some("filtered_in".to_owned());
        let frame = FrameFate { refused, ..frame(vec![link("fc", "route", true)]) };
        assert!(!frame.arrives());
        let text = told(vec![frame]);
        let expected = "not taken from gcs (10.0.0.2:14550): its lists of what comes in";
        assert!(text.contains(expected) && !text.contains("to fc"), "{text}");
    }

    #[test]
    fn what_hangs_on_a_signature_is_told_with_that() {
        let frame =
            FrameFate { if_signature_is_good: true, ..frame(vec![link("fc", "route", true)]) };
        let text = told(vec![frame]);
        assert_eq!(
            text,
            "255/190 -> 1/1 PARAM_SET: from gcs (10.0.0.2:14550) to fc, if its signature is good\n"
        );
    }

    #[test]
    fn of_somebody_unheard_it_is_told_who_was_heard() {
        let heard = vec![HeardStatus { endpoint: "fc".to_owned(), ..HeardStatus::default() }];
        let component = ComponentStatus { system: 3, component: 1, heard, vehicle: None };
        let snapshot = Snapshot { components: vec![component], ..Snapshot::default() };
        let why = Why { from: "1/1".to_owned(), to: "all".to_owned(), ..Why::default() };
        let text = why.to_text(&snapshot);
        assert!(text.starts_with("1/1 was never heard; heard were 3/1 on fc\n"), "{text}");
    }
}
