//! Any bytes as a file with a signing key.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::config::fuzz_key(data));
