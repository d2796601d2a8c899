//! Any bytes as a telemetry log.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::record::fuzz_tlog(data));
