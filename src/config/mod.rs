//! What the user configures.

mod dialect_files;
mod dialect_rows;

pub use dialect_files::{DialectFileError, load_dialect};
pub use dialect_rows::write_rows;
