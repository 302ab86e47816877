//! Any bytes as a file of the format that the variable `FORMAT` names.
#![no_main]

use std::sync::LazyLock;
use wiperlab::import::format_names;

static FORMAT: LazyLock<String> = LazyLock::new(|| {
    let name = std::env::var("FORMAT").expect("FORMAT names the format");
    assert!(format_names().contains(&name.as_str()), "there is no format {name}");
    name
});

libfuzzer_sys::fuzz_target!(|data: &[u8]| wiperlab_fuzz::imports::check(&FORMAT, data));
