//! The same bits on every machine. The hashes are those of x86-64 with Linux; a machine on which a test fails
//! computes other last digits than that one, and a change that fails one is marked **numbers** in the
//! changelog.

use crate::scenes::committed;
use portable_math as math;
use short_spectra::{SampledRecord, SpectralAnalysis, SpectrumSettings};
use wiperlab::simulate::outputs::Transitions;
use wiperlab::simulate::{RunStatus, run_scene};
use wiperlab::text::text_sha256;

/// Hash of numbers, with all their digits.
fn hash(numbers: impl IntoIterator<Item = f64>) -> String {
    text_sha256(numbers.into_iter().map(|x| format!("{x:e}\n")).collect::<String>().as_bytes())
}

#[test]
fn functions_round_as_they_do_elsewhere() {
    // products of exact operations: the same arguments everywhere, of all sizes
    let arguments: Vec<f64> = (1..=2000_u32).map(|k| f64::from(k) * f64::from(k) / 7919.0).collect();
    let mut values = Vec::new();
    for (x, small) in arguments.iter().map(|x| (*x, (x / 1000.0 - 0.25).clamp(-1.0, 1.0))) {
        let (sin, cos) = math::sin_cos(-x);
        values.extend([sin, cos, math::sin(x), math::cos(x), math::tan(x)]);
        values.extend([math::asin(small), math::acos(small), math::atan(x), math::atan2(small, x)]);
        values.extend([math::exp(small * 20.0), math::ln(x), math::ln_1p(small), math::log10(x)]);
        values.extend([math::tanh(small), math::powf(x, small), math::powi(x, -7), math::hypot(x, small)]);
    }
    assert_eq!(hash(values), "617951a40d2e43d69bef6c32a4fedfbe8c66c95342be94c04e3cb3ffaadbe35a");
}

#[test]
fn transitions_of_a_run_are_at_the_same_times() {
    let mut transitions = Transitions::default();
    assert_eq!(run_scene(&committed("actual-blade"), &mut transitions).status, RunStatus::Completed);
    assert_eq!(transitions.0.len(), 380);
    assert_eq!(
        hash(transitions.0.iter().map(|t| t.time_s)),
        "60e8e4ec8515393d263fbc5bc80d1f92d0e01d910a9d9642304a2d7bc37fb0e6"
    );
}

#[test]
fn components_of_a_record_have_the_same_digits() {
    let sample = |i: u32| {
        let t = f64::from(i) / 2000.0;
        let ring_down = 3e-4 * math::exp(-9.0 * t) * math::cos(480.0 * t);
        Some(ring_down + 1e-4 * math::sin(1900.0 * t) + 2e-7 * math::sin(1e4 * t * t))
    };
    let samples: Vec<_> = (0..900).map(sample).collect();
    let record = SampledRecord { samples: &samples, frame_rate_hz: 2000.0, exposure_s: None };
    let components =
        SpectralAnalysis::from_record(&record, &SpectrumSettings::default()).unwrap().spectrum.components;
    assert_eq!(components.len(), 5, "{components:#?}");
    let numbers = components.iter().flat_map(|c| [c.frequency_hz, c.amplitude_m, c.snr_db]);
    assert_eq!(hash(numbers), "bad648c298059a13384105bf304c7ac3bdf8fec30f61f811b63fd2b7d838f71e");
}
