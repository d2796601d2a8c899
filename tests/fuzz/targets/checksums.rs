//! The splitter again, with checksums put right, so that what stands behind them is reached.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::mavlink::fuzz_splitter_with_checksums(data));
