//! Lumel frames.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lumencast_fuzz::video_frames(data));
