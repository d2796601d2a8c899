//! The status page: one file with all that it needs, which asks for `/status.json` each second.

/// The page, as it is served.
pub const PAGE: &str = include_str!("page.html");
