//! Serial devices and their baud rates: `/dev/ttyACM0:57600`, `auto:921600,57600`.
//!
//! A name that udev gives may itself contain colons and digits
//! (`/dev/serial/by-path/platform-3f980000.usb-usb-0:1.2:1.0-port0`). So a last piece is read as
//! baud rates only if it holds nothing but digits and commas. Two things follow: a name that ends
//! in a colon and digits must have its baud rate written, and a mistyped rate would be taken for
//! part of the name. Against the latter, files of `/dev` itself are read more strictly: the
//! kernel's names (`ttyACM0`) have neither colons nor commas.

use std::fmt;
use std::path::PathBuf;

use super::error::AddressProblem;
use super::value;

/// The baud rate of a serial port unless told otherwise: that of a telemetry radio.
pub(super) const DEFAULT_BAUD: u32 = 57_600;

/// Which serial port.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Device {
    /// The one with this absolute path.
    Path(PathBuf),
    /// The first one that looks like a flight controller.
    Auto,
}

impl fmt::Display for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Path(path) => path.display().fmt(f),
            Self::Auto => f.write_str(AUTO),
        }
    }
}

const AUTO: &str = "auto";

/// Reads `DEVICE`, `DEVICE:BAUD,...` or `DEVICE,BAUD,...`; no bauds means that none were written.
pub(super) fn parse(text: &str) -> Result<(Device, Vec<u32>), AddressProblem> {
    // One slash, or the canonical text would look like a URL.
    let slashes = text.len() - text.trim_start_matches('/').len();
    let (device, bauds) = split(&text[slashes.saturating_sub(1)..]);
    let device = parse_device(device)?;
    let bauds = bauds.map(parse_bauds).transpose()?;
    Ok((device, bauds.unwrap_or_default()))
}

fn parse_device(text: &str) -> Result<Device, AddressProblem> {
    if text.is_empty() {
        return Err(AddressProblem::NoDevice);
    }
    if text.eq_ignore_ascii_case(AUTO) {
        return Ok(Device::Auto);
    }
    if text.starts_with('/') {
        return Ok(Device::Path(PathBuf::from(text)));
    }
    let name = text.strip_prefix("dev/").unwrap_or(text);
    let meant = format!("/dev/{name}");
    Err(AddressProblem::RelativeDevice(text.to_owned(), meant))
}

/// Reads `BAUD,...`.
pub(super) fn parse_bauds(text: &str) -> Result<Vec<u32>, AddressProblem> {
    let parse =
        |baud: &str| value::baud(baud).ok_or_else(|| AddressProblem::BadBaud(baud.to_owned()));
    text.split(',').map(parse).collect()
}

/// Cuts off the baud rates, if there are any.
fn split(text: &str) -> (&str, Option<&str>) {
    if is_plain(text) {
        return match text.split_once([':', ',']) {
            Some((device, bauds)) => (device, Some(bauds)),
            None => (text, None),
        };
    }
    let name = text.trim_end_matches(|c: char| c.is_ascii_digit() || c == ',');
    let digits = &text[name.len()..];
    if let Some(device) = name.strip_suffix(':') {
        return (device, Some(digits));
    }
    match digits.find(',') {
        Some(comma) => {
            let comma = name.len() + comma;
            (&text[..comma], Some(&text[comma + 1..]))
        }
        None => (text, None),
    }
}

/// Whether the device is one whose name has neither colons nor commas.
fn is_plain(text: &str) -> bool {
    let name = text.strip_prefix("/dev/").unwrap_or(text);
    !name.contains('/')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn baud_rates_are_told_from_the_colons_of_a_name() {
        for (text, device, bauds) in [
            ("/dev/ttyACM0", "/dev/ttyACM0", None),
            ("/dev/ttyACM0:57600", "/dev/ttyACM0", Some("57600")),
            ("/dev/ttyACM0,57600", "/dev/ttyACM0", Some("57600")),
            ("/dev/ttyS1:5,6", "/dev/ttyS1", Some("5,6")),
            ("/dev/ttyS1,5,6", "/dev/ttyS1", Some("5,6")),
            ("/dev/ttyS1:57k6", "/dev/ttyS1", Some("57k6")),
            ("/dev/ttyS1:", "/dev/ttyS1", Some("")),
            ("auto:57600", "auto", Some("57600")),
            ("/dev/pts/3", "/dev/pts/3", None),
            ("/dev/pts/3:57600", "/dev/pts/3", Some("57600")),
            ("/dev/pts/3,57600,9600", "/dev/pts/3", Some("57600,9600")),
        ] {
            assert_eq!(split(text), (device, bauds), "{text}");
        }
    }

    #[test]
    fn names_by_path_keep_their_colons() {
        for name in [
            "/dev/serial/by-path/platform-3f980000.usb-usb-0:1.2:1.0-port0",
            "/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0",
            "/dev/serial/by-path/pci-0000:00:16.3",
            "/dev/serial/by-id/usb-3D_Robotics_PX4_FMU_v2.x_0-if00",
            "/run/gcs/pty:far",
        ] {
            assert_eq!(split(name), (name, None));
            for bauds in ["57600", "921600,57600"] {
                let with_colon = format!("{name}:{bauds}");
                assert_eq!(split(&with_colon), (name, Some(bauds)));
                let with_comma = format!("{name},{bauds}");
                assert_eq!(split(&with_comma), (name, Some(bauds)));
            }
        }
        let ends_in_digits = "/dev/serial/by-path/acpi-PNP0501:00";
        let with_baud = format!("{ends_in_digits}:57600");
        assert_eq!(split(&with_baud), (ends_in_digits, Some("57600")));
        assert_eq!(parse(ends_in_digits), Err(AddressProblem::BadBaud("00".to_owned())));
    }
}
