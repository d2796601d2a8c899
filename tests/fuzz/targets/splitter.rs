//! Any bytes, in any pieces, to the splitter.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::mavlink::fuzz_splitter(data));
