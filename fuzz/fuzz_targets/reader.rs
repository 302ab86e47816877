//! Any text as a file of the reader that the variable `READER` names.
#![no_main]

use std::sync::LazyLock;
use wiperlab_fuzz::readers::{READERS, Reader};

static READER: LazyLock<&'static Reader> = LazyLock::new(|| {
    let name = std::env::var("READER").expect("READER names the reader");
    READERS.iter().find(|reader| reader.name == name).expect("READER names a reader of fuzz/src/readers.rs")
});

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    if let Ok(text) = std::str::from_utf8(data) {
        (READER.check)(text);
    }
});
