//! How a frame looks: as one line for people, or as a line of JSON for programs.

use serde_json::{Map, Value as Json, json};

use super::frames::{SeenFrame, from_hex};
use crate::mavlink::{
    Component, Crc, Definition, Dialect, Frame, Header, Layouts, Target, Value, Version,
    implied_extra,
};
use crate::printable::{escape_json, printable};

/// Reads frames for who listens.
pub struct Reader {
    dialect: Dialect,
    layouts: Layouts,
}

/// How wide the columns are: as wide as the widest so far, so that the lines stand below each other.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Widths {
    from: usize,
    to: usize,
    name: usize,
}

/// A column grows no wider than this.
const WIDEST: usize = 28;

impl Default for Widths {
    fn default() -> Self {
        Self { from: 4, to: 4, name: 20 }
    }
}

impl Reader {
    /// Reads what these definitions say.
    pub fn new(dialect: Dialect, layouts: Layouts) -> Self {
        Self { dialect, layouts }
    }

    /// The frame as a line for people, without its end; `None` if its bytes are no frame.
    pub fn line(&self, seen: &SeenFrame, widths: &mut Widths, colour: bool) -> Option<String> {
        let bytes = from_hex(&seen.bytes)?;
        let frame = Frame::parse(&bytes).ok()?;
        let header = frame.header();
        let (name, target) = (self.name(&frame), self.target(&frame));
        let to = printable(&destinations(seen));
        let from = printable(&seen.endpoint);
        widths.grow(&from, &to, &name);
        let Widths { from: wide_from, to: wide_to, name: wide_name } = *widths;
        let (bold, dim, plain) =
            if colour { ("\x1b[1m", "\x1b[2m", "\x1b[0m") } else { ("", "", "") };
        let mut line = format!(
            "{dim}{}{plain} {from:<wide_from$} > {to:<wide_to$} {:>7} -> {:<7} \
             {bold}{name:<wide_name$}{plain} {:>3}",
            clock(seen.time_us),
            header.source.to_string(),
            target.map_or_else(|| "all".to_owned(), shown_target),
            header.len,
        );
        for (name, value) in self.fields(&frame) {
            line += &format!(" {dim}{name}={plain}{value}");
        }
        Some(line)
    }

    /// The frame as a line of JSON, without its end; `None` if its bytes are no frame.
    pub fn json(&self, seen: &SeenFrame) -> Option<String> {
        let bytes = from_hex(&seen.bytes)?;
        let frame = Frame::parse(&bytes).ok()?;
        let Header { version, len, signed, seq, source, id } = frame.header();
        let fields: Map<String, Json> =
            self.fields(&frame).map(|(name, value)| (name.to_owned(), to_json(&value))).collect();
        let target = self.target(&frame).unwrap_or(Component::new(0, 0));
        let mut line = json!({
            "time_us": seen.time_us, "endpoint": seen.endpoint, "link": seen.link, "to": seen.to,
            "verified": seen.verified, "version": if version == Version::V1 { 1 } else { 2 },
            "seq": seq, "system": source.system, "component": source.component,
            "target_system": target.system, "target_component": target.component, "id": id.0,
            "name": self.definition(&frame).map(|it| it.name.as_ref()), "len": len,
            "signed": signed, "bytes": seen.bytes,
        });
        if let Json::Object(line) = &mut line {
            if self.layouts.find(&frame).is_some() {
                line.insert("fields".to_owned(), Json::Object(fields));
            }
            if !seen.refused.is_empty() {
                line.insert("refused".to_owned(), json!(seen.refused));
            }
            line.extend(seen.dropped.iter().map(|it| ("dropped".to_owned(), json!(it))));
        }
        Some(escape_json(&line.to_string()))
    }

    /// The definition that the frame was made with.
    fn definition(&self, frame: &Frame<'_>) -> Option<&Definition> {
        let id = frame.header().id;
        let crc_extra = implied_extra(Crc::of(frame.checked_bytes()), frame.checksum());
        let exact = crc_extra.and_then(|crc_extra| self.dialect.by_pair(id, crc_extra));
        exact.or_else(|| self.dialect.by_id(id))
    }

    fn name(&self, frame: &Frame<'_>) -> String {
        let definition = self.definition(frame);
        definition.map_or_else(|| format!("id={}", frame.header().id), |it| it.name.to_string())
    }

    fn target(&self, frame: &Frame<'_>) -> Option<Component> {
        let byte = |at| frame.payload_byte(at);
        let target = match self.definition(frame)?.target {
            Target::None => return None,
            Target::System(system) => Component::new(byte(system), 0),
            Target::SystemComponent(system, component) => {
                Component::new(byte(system), byte(component))
            }
        };
        (target.system != 0).then_some(target)
    }

    fn fields<'a>(&'a self, frame: &'a Frame<'_>) -> impl Iterator<Item = (&'a str, Value)> {
        let layout = self.layouts.find(frame).into_iter();
        let fields = layout.flat_map(|layout| &layout.fields);
        fields.map(|field| (field.name.as_str(), self.layouts.read(frame, field)))
    }
}

impl Widths {
    fn grow(&mut self, from: &str, to: &str, name: &str) {
        let wide = |text: &str| text.chars().count().min(WIDEST);
        self.from = self.from.max(wide(from));
        self.to = self.to.max(wide(to));
        self.name = self.name.max(wide(name));
    }
}

fn shown_target(target: Component) -> String {
    if target.component == 0 { target.system.to_string() } else { target.to_string() }
}

/// Where it went, or why not.
fn destinations(seen: &SeenFrame) -> String {
    if let Some(reason) = &seen.dropped {
        return format!("({reason})");
    }
    let mut parts: Vec<String> = Vec::new();
    for name in &seen.to {
        if !parts.contains(name) {
            parts.push(name.clone());
        }
    }
    parts.extend(seen.refused.iter().map(|(name, reason)| format!("{name}({reason})")));
    if parts.is_empty() { "nobody".to_owned() } else { parts.join(",") }
}

/// The time of day in UTC, to the millisecond.
fn clock(time_us: u64) -> String {
    let (seconds, millis) = (time_us / 1_000_000, time_us / 1_000 % 1_000);
    let (hours, minutes) = (seconds / 3_600 % 24, seconds / 60 % 60);
    format!("{hours:02}:{minutes:02}:{:02}.{millis:03}", seconds % 60)
}

fn to_json(value: &Value) -> Json {
    match value {
        Value::Unsigned(number) | Value::Named(number, _) => json!(number),
        Value::Signed(number) => json!(number),
        // What is no number has none in JSON: null.
        // By its own digits, not by those of the nearest number of twice the length.
        Value::Float(number) if number.is_finite() => json!(number.to_string().parse::<f64>().ok()),
        Value::Float(_) => Json::Null,
        Value::Double(number) => json!(number),
        Value::Text(text) => json!(text),
        Value::List(values) => Json::Array(values.iter().map(to_json).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::listen::to_hex;
    use crate::mavlink::{FrameSpec, MessageId, encode};

    fn seen(id: u32, crc_extra: u8, payload: &[u8]) -> SeenFrame {
        let mut bytes = Vec::new();
        let (source, id) = (Component::new(1, 1), MessageId(id));
        let (version, seq, signature) = (Version::V2, 7, None);
        encode(&FrameSpec { version, seq, source, id, crc_extra, payload, signature }, &mut bytes);
        SeenFrame {
            time_us: 1_767_225_600_000_000 + 45_296_007_000,
            endpoint: "fc".to_owned(),
            link: 3,
            to: vec!["gcs".to_owned(), "gcs".to_owned()],
            verified: true,
            bytes: to_hex(&bytes),
            ..SeenFrame::default()
        }
    }

    fn reader() -> Reader {
        Reader::new(Dialect::builtin(), Layouts::builtin())
    }

    #[test]
    fn a_line_tells_when_which_way_who_whom_what() {
        let heartbeat = seen(0, 50, &[0, 0, 0, 0, 2, 3, 81, 4, 3]);
        let line = reader().line(&heartbeat, &mut Widths::default(), false).unwrap();
        assert_eq!(
            line,
            "12:34:56.007 fc   > gcs      1/1 -> all     HEARTBEAT              9 type=QUADROTOR \
             autopilot=ARDUPILOTMEGA base_mode=81 custom_mode=0 system_status=ACTIVE \
             mavlink_version=3"
        );
        let mut ack = seen(77, 143, &[144, 1, 0, 0, 0, 0, 0, 0, 255, 190]);
        (ack.to, ack.dropped) = (Vec::new(), Some("no_route".to_owned()));
        let line = reader().line(&ack, &mut Widths::default(), false).unwrap();
        assert!(line.contains(" fc   > (no_route)     1/1 -> 255/190 COMMAND_ACK "), "{line}");
    }

    #[test]
    fn json_has_numbers_and_what_a_program_needs_to_find_the_frame_again() {
        let line = reader().json(&seen(0, 50, &[0, 0, 0, 0, 2, 3, 81, 4, 3])).unwrap();
        let read: Json = serde_json::from_str(&line).unwrap();
        assert_eq!((&read["name"], &read["fields"]["type"]), (&json!("HEARTBEAT"), &json!(2)));
        assert_eq!((&read["seq"], &read["target_system"]), (&json!(7), &json!(0)));
        let unknown = reader().json(&seen(54_321, 9, &[1])).unwrap();
        let read: Json = serde_json::from_str(&unknown).unwrap();
        assert_eq!((&read["name"], &read["fields"]), (&Json::Null, &Json::Null));
    }

    #[test]
    fn nothing_that_comes_from_the_network_moves_the_cursor() {
        let text = seen(253, 83, b"\x06\x1b[2J\nrm -rf\x7f");
        let line = reader().line(&text, &mut Widths::default(), false).unwrap();
        assert!(line.contains(r#"text="\u{1b}[2J\nrm -rf\u{7f}""#), "{line}");
        assert!(!line.contains(char::is_control));
        let text = seen(253, 83, "\x06\u{9b}2J\u{7f}\u{202e}\u{2066}é".as_bytes());
        let json = reader().json(&text).unwrap();
        assert!(json.contains(r"\u009b2J\u007f\u202e\u2066é"), "{json}");
        let read: Json = serde_json::from_str(&json).unwrap();
        assert_eq!(read["fields"]["text"], json!("\u{9b}2J\u{7f}\u{202e}\u{2066}é"));
        let mut odd = seen(0, 50, &[1]);
        odd.endpoint = "\x1b[2J".to_owned();
        assert!(!reader().line(&odd, &mut Widths::default(), false).unwrap().contains('\x1b'));
    }
}
