//! Any line at the control socket.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::control::fuzz_request(data));
