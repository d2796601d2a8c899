//! Any text as an endpoint of the command line.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::config::fuzz_endpoint(data));
