//! Any text as a file of message definitions.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::mavlink::fuzz_definitions(data));
