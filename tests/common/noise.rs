//! Normal noise for tests, the same on every platform.

/// The sum of twelve uniform numbers of a fixed generator, less its mean: normal to all that a test can tell.
pub fn noise(mut seed: u64) -> impl FnMut() -> f64 {
    move || {
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}
