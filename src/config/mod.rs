//! What the user configures: endpoints. One grammar serves the command line and the file.
//!
//! This layer reads text, the configuration files, and the files of `--dialect`. It opens no link and resolves no names:
//! whether a device is there and what a host name means is found out by those who use the endpoint.
//!
//! An endpoint is an address and, behind a `?`, options, as in a URL:
//! `udpout:10.0.0.2:14550?name=gcs&bind=0.0.0.0:14551`. Each kind of address has one canonical
//! spelling; what users know from other MAVLink programs is read as the same thing. Whatever is
//! read here is complete and in range, so nobody has to check it again.

mod address;
mod control_place;
mod device;
mod dialect_files;
mod dialect_rows;
mod difference;
mod endpoint;
mod error;
mod file;
mod general;
mod host_port;
mod import;
mod key_files;
mod layer;
mod merge;
mod network;
mod option_spec;
mod option_table;
mod options;
mod own;
mod place;
mod query;
mod record;
mod shape;
mod source;
mod suggest;
mod value;
mod write;

pub use address::{Address, AddressKind};
pub use control_place::ControlPlace;
pub use device::Device;
pub use dialect_files::{DialectFileError, load_dialect, load_layouts};
pub use dialect_rows::write_rows;
pub use difference::Difference;
pub use endpoint::{EndpointConfig, fuzz_endpoint};
pub use error::{AddressError, AddressProblem};
pub use file::{CONFIG_DIR, default_files, fuzz_config, load_config, parse_config};
pub use general::{GENERAL, General, GeneralSpec, LogFormat, LogLevel, key_file, seconds};
pub use host_port::{Host, HostPort};
pub use import::{
    ENDPOINT_KEYS, EndpointKey, GENERAL_KEYS, GeneralKey, Imported, ROUTERD_DIR, RouterdArguments,
    RouterdFiles, SectionKind, TcpServer, fuzz_import, import_routerd,
};
pub use key_files::{
    KeyError, KeyFile, KeyRef, MAX_LEN as MAX_KEY_FILE, fuzz_key, load_keys, read_keys, unused_keys,
};
pub use merge::{Config, Endpoint, MAX_ENDPOINTS};
pub use network::Network;
pub use option_spec::{OnChange, OptionSpec};
pub use option_table::OPTIONS;
pub use options::{EndpointOptions, FilterOptions, FlowControl, MessageRef, PathChoice};
pub use own::OwnOptions;
pub use place::{ConfigError, ConfigProblem, Place};
pub use record::{FlightLog, RecordOptions, RecordWhen, any_time, size};
pub use shape::Shape;
pub use source::MAX_LEN as MAX_CONFIG_FILE;
pub use suggest::message_hint;
pub(crate) use suggest::nearest;
pub use value::{ids, messages};
