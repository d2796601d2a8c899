//! What the user configures: endpoints. One grammar serves the command line and the file.
//!
//! This layer reads text, and the files of `--dialect`. It opens no link and resolves no names:
//! whether a device is there and what a host name means is found out by those who use the endpoint.
//!
//! An endpoint is an address and, behind a `?`, options, as in a URL:
//! `udpout:10.0.0.2:14550?name=gcs&bind=0.0.0.0:14551`. Each kind of address has one canonical
//! spelling; what users know from other MAVLink programs is read as the same thing. Whatever is
//! read here is complete and in range, so nobody has to check it again.

mod address;
mod device;
mod dialect_files;
mod dialect_rows;
mod endpoint;
mod error;
mod host_port;
mod option_spec;
mod option_table;
mod options;
mod query;
mod suggest;
mod value;

pub use address::{Address, AddressKind};
pub use device::Device;
pub use dialect_files::{DialectFileError, load_dialect};
pub use dialect_rows::write_rows;
pub use endpoint::{EndpointConfig, fuzz_endpoint};
pub use error::{AddressError, AddressProblem};
pub use host_port::{Host, HostPort};
pub use option_spec::OptionSpec;
pub use option_table::OPTIONS;
pub use options::{EndpointOptions, FilterOptions, FlowControl, MessageRef, PathChoice};
