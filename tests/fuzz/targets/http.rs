//! A request by HTTP, as strangers send them.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::daemon::fuzz_http_request(data));
