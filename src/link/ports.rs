//! The serial ports of this computer: what each one is, and which of them is a flight controller.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serialport::SerialPortType;

/// A serial port.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Port {
    /// Its device node: `/dev/ttyACM0`.
    pub device: PathBuf,
    /// What is behind it, as far as it says so: `ArduPilot Pixhawk6X`.
    pub description: String,
    /// USB vendor and product id.
    pub usb: Option<(u16, u16)>,
    /// A name that stays the same whatever number the device gets, under `/dev/serial/by-id`.
    pub by_id: Option<PathBuf>,
    /// Whether this program may open it, or why not.
    pub access: Access,
    /// Whether it looks like a flight controller.
    pub is_flight_controller: bool,
}

/// Whether a port may be opened.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Access {
    /// It may.
    Granted,
    /// The user lacks the permission.
    Denied,
    /// It fails for another reason.
    Fails(String),
}

/// Two lines or three: device and what it is; who may open it; the name that stays.
impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<14}  {}", self.device.display(), self.description)?;
        if let Some((vendor, product)) = self.usb {
            write!(f, " (USB {vendor:04x}:{product:04x})")?;
        }
        if self.is_flight_controller {
            write!(f, ", a flight controller: serial:auto finds it")?;
        }
        match &self.access {
            Access::Granted => {}
            Access::Denied => {
                write!(f, "\n                permission denied: is the user in group dialout?")?;
            }
            Access::Fails(reason) => write!(f, "\n                cannot be opened: {reason}")?,
        }
        match &self.by_id {
            Some(name) => write!(f, "\n                always {}", name.display()),
            None => Ok(()),
        }
    }
}

/// All serial ports that have hardware behind them, in the order of their names.
pub fn list_ports() -> Vec<Port> {
    let by_id = by_id_names(Path::new("/dev/serial/by-id"));
    // Fails where there is no /sys: then there are no ports to be found.
    let found = serialport::available_ports().unwrap_or_default();
    let mut ports: Vec<Port> = found.into_iter().map(|info| describe(info, &by_id)).collect();
    ports.sort_by(|a, b| a.device.cmp(&b.device));
    ports.dedup_by(|a, b| a.device == b.device);
    ports
}

/// The flight controller to use when the user names none: the first one, by the name that stays.
///
/// Flight controllers with two USB ports speak MAVLink on the first, which the order of names
/// respects.
pub fn find_flight_controller() -> Option<PathBuf> {
    let ports = list_ports().into_iter().filter(|port| port.is_flight_controller);
    ports.map(|port| port.by_id.unwrap_or(port.device)).min()
}

fn describe(info: serialport::SerialPortInfo, by_id: &[(PathBuf, PathBuf)]) -> Port {
    let device = PathBuf::from(&info.port_name);
    let stable = by_id.iter().find(|(_, target)| *target == device);
    let by_id = stable.map(|(name, _)| name.clone());
    let (description, usb) = match info.port_type {
        SerialPortType::UsbPort(usb) => {
            let words = [usb.manufacturer, usb.product].into_iter().flatten();
            (words.collect::<Vec<_>>().join(" "), Some((usb.vid, usb.pid)))
        }
        SerialPortType::PciPort => ("serial port of this computer".to_owned(), None),
        SerialPortType::BluetoothPort => ("Bluetooth".to_owned(), None),
        SerialPortType::Unknown => ("serial port of this computer".to_owned(), None),
    };
    let name = by_id.as_deref().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
    Port {
        access: access(&device),
        is_flight_controller: is_flight_controller(&name, &description, usb),
        device,
        description,
        usb,
        by_id,
    }
}

/// Asked without opening the port: that would raise its control lines, which restarts some boards.
fn access(device: &Path) -> Access {
    use rustix::fs::{Access as Mode, access};
    match access(device, Mode::READ_OK | Mode::WRITE_OK) {
        Ok(()) => Access::Granted,
        Err(rustix::io::Errno::ACCESS) => Access::Denied,
        Err(error) => Access::Fails(io::Error::from(error).to_string()),
    }
}

/// The links in a folder such as `/dev/serial/by-id`, and the devices they lead to.
fn by_id_names(folder: &Path) -> Vec<(PathBuf, PathBuf)> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let target = |entry: io::Result<fs::DirEntry>| {
        let name = entry.ok()?.path();
        let target = name.canonicalize().ok()?;
        Some((name, target))
    };
    entries.filter_map(target).collect()
}

/// Whether names or USB ids are those of a flight controller.
fn is_flight_controller(by_id: &str, description: &str, usb: Option<(u16, u16)>) -> bool {
    let is_known_id = |(vendor, product): (u16, u16)| {
        VENDORS.contains(&vendor) || PRODUCTS.contains(&(vendor, product))
    };
    let text = format!("{by_id} {description}").to_lowercase();
    usb.is_some_and(is_known_id) || NAMES.iter().any(|name| text.contains(name))
}

/// Makers of flight controllers who have a USB vendor id of their own: 3D Robotics, Holybro,
/// CubePilot, Laser Navigation, ARK, CUAV.
const VENDORS: [u16; 6] = [0x26ac, 0x3162, 0x2dae, 0x27ac, 0x3185, 0x3612];

/// Flight controllers under shared vendor ids: ArduPilot's own, with one and with two ports.
const PRODUCTS: [(u16, u16); 3] = [(0x1209, 0x5740), (0x1209, 0x5741), (0x1209, 0x5738)];

/// What the names of flight controllers have in them.
const NAMES: [&str; 9] = [
    "ardupilot",
    "px4",
    "pixhawk",
    "cubepilot",
    "hex_cube",
    "fmuv",
    "holybro",
    "mrobotics",
    "autopilot",
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_dir::TestDir;

    #[test]
    fn flight_controllers_are_known_by_name_or_by_usb_id() {
        let by_id = "usb-ArduPilot_Pixhawk6X_3B0033-if00";
        assert!(is_flight_controller(by_id, "", None));
        assert!(is_flight_controller("", "3D Robotics PX4 FMU v2.x", None));
        assert!(is_flight_controller("", "", Some((0x2dae, 0x1016))));
        assert!(is_flight_controller("", "", Some((0x1209, 0x5741))));
        assert!(!is_flight_controller(
            "usb-FTDI_FT232R-if00-port0",
            "FTDI FT232R",
            Some((0x0403, 0x6001))
        ));
    }

    #[test]
    fn a_port_tells_what_it_is_and_what_stands_in_the_way() {
        let port = Port {
            device: "/dev/ttyACM0".into(),
            description: "ArduPilot Pixhawk6X".into(),
            usb: Some((0x1209, 0x5741)),
            by_id: Some("/dev/serial/by-id/usb-ArduPilot-if00".into()),
            access: Access::Denied,
            is_flight_controller: true,
        };
        let expected = "\
/dev/ttyACM0    ArduPilot Pixhawk6X (USB 1209:5741), a flight controller: serial:auto finds it
                permission denied: is the user in group dialout?
                always /dev/serial/by-id/usb-ArduPilot-if00";
        assert_eq!(port.to_string(), expected);
    }

    #[test]
    fn names_by_id_lead_to_the_device_they_mean_now() {
        let dir = TestDir::new();
        let folder = dir.path();
        let device = dir.write("ttyACM1", "");
        std::os::unix::fs::symlink(&device, folder.join("usb-ArduPilot")).unwrap();
        let names = by_id_names(folder);
        let device = device.canonicalize().unwrap();
        assert!(names.contains(&(folder.join("usb-ArduPilot"), device)));
    }
}
