//! Serial ports: 8N1, raw, exclusive, never waiting.

use std::fs::File;
use std::io;
use std::path::Path;

use rustix::termios;

use super::sys;

/// How a port is set up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SerialSettings {
    /// Bits a second; any rate that the hardware takes.
    pub baud: u32,
    /// Whether the wires RTS and CTS say when each side may send.
    pub rtscts: bool,
}

/// Opens a serial port for this program alone.
///
/// # Errors
///
/// As `open(2)`; `ResourceBusy` if another program has it, `NotFound` if there is no such device.
pub fn open_serial(device: &Path, settings: SerialSettings) -> io::Result<File> {
    let flow = match settings.rtscts {
        false => serialport::FlowControl::None,
        true => serialport::FlowControl::Hardware,
    };
    let builder = serialport::new(device.to_string_lossy(), settings.baud).flow_control(flow);
    let port = serialport::TTYPort::open(&builder).map_err(|error| match error.kind() {
        // So the library calls a port that another program has locked.
        serialport::ErrorKind::NoDevice => io::ErrorKind::ResourceBusy.into(),
        _ => io::Error::from(error),
    })?;
    let file = sys::into_nonblocking_file(port)?;
    // Frames in a few milliseconds instead of sixteen, where the driver can; many cannot.
    let _ = sys::set_low_latency(&file);
    Ok(file)
}

/// Changes the baud rate of a port that is open.
///
/// # Errors
///
/// As `tcsetattr(3)`.
pub fn set_baud(port: &File, baud: u32) -> io::Result<()> {
    let mut attributes = termios::tcgetattr(port)?;
    attributes.set_speed(baud)?;
    // What was received at the other rate makes no sense.
    termios::tcflush(port, termios::QueueSelector::IFlush)?;
    Ok(termios::tcsetattr(port, termios::OptionalActions::Now, &attributes)?)
}
