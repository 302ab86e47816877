//! Checks that are used for several tables of a job.

use crate::toml_file::KeyRefusal;
use std::collections::HashSet;

pub(super) fn check_non_empty(key: &str, found: &str, expected: &str) -> Result<String, KeyRefusal> {
    if found.trim().is_empty() {
        refuse!(key, "found \"{found}\", expected {expected}");
    }
    Ok(found.to_owned())
}

pub(super) fn find_repeated<'a>(mut names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let mut met = HashSet::new();
    names.find(|name| !met.insert(*name))
}
