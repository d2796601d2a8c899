//! Payloads of any bytes, read field by field.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::mavlink::fuzz_fields(data));
