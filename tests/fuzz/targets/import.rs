//! Any bytes as a configuration file of mavlink-router.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::config::fuzz_import(data));
