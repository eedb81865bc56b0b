//! All that a client reads.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lumencast_fuzz::reader(data));
