//! The configuration of mavlink-router, read as our own.
//!
//! The files are read line by line (`ini`), files and command line become one list of sections
//! (`merge`), the tables of keys say what each line means (`general_keys`, `endpoint_keys`), and an
//! endpoint of theirs becomes one of ours (`endpoint`). What comes out is a `Config` like that
//! of any other file, so that nobody else knows where it came from; what has no equivalent is told
//! in notes.

mod arguments;
mod endpoint;
mod endpoint_keys;
mod files;
mod general_keys;
mod ini;
mod merge;
mod names;
mod read;
mod value;
mod write;

pub use arguments::RouterdArguments;
pub use endpoint_keys::{ENDPOINT_KEYS, EndpointKey, SectionKind};
pub use files::{ROUTERD_DIR, RouterdFiles};
pub use general_keys::{GENERAL_KEYS, GeneralKey};
pub use read::{Imported, TcpServer, fuzz_import, import_routerd};

#[cfg(test)]
mod tests;
