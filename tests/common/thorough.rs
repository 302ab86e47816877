//! Whether a test is to be thorough: `.ci/thorough` sets the variable, with which some tests take minutes.

/// The first of two numbers in the tests of every change, the second in those before a release.
pub fn pick<T>(every_change: T, thorough: T) -> T {
    if is_thorough() { thorough } else { every_change }
}

pub fn is_thorough() -> bool {
    std::env::var_os("WIPERLAB_THOROUGH").is_some()
}
