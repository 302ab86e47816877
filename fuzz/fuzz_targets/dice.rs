#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| wiperlab_fuzz::check("dice", data));
