//! Records too long to be taken apart: components from the windowed periodogram, judged by the same criteria.

use super::{Analysis, Record, Removed};
use crate::spectrum::judge::{Circumstances, Evidence, judge};
use crate::spectrum::trend::Trend;
use crate::spectrum::{Detrend, Settings, SpectrumError, analyse};

pub(super) fn analysis(
    record: &Record,
    settings: &Settings,
    trend: Trend,
) -> Result<Analysis, SpectrumError> {
    let mut spectrum = analyse(record.samples, record.frame_rate_hz, settings)?;
    let circumstances = Circumstances {
        frame_rate_hz: record.frame_rate_hz,
        exposure_s: record.exposure_s,
        resolution_hz: spectrum.resolution_hz,
        fastest_hz: settings.fastest_hz,
    };
    let evidence = vec![Evidence { stays: true, ..Evidence::default() }; spectrum.components.len()];
    judge(&mut spectrum.components, &evidence, &circumstances);
    let removed_m = trend.of(record.samples);
    Ok(Analysis {
        spectrum,
        left_out: 0,
        stride: 1,
        removed: Removed { detrend: settings.detrend.unwrap_or(Detrend::Cubic), relaxations: 0 },
        leakage_m: Vec::new(),
        model_m: vec![0.0; record.samples.len()],
        left_m: record.samples.iter().zip(&removed_m).map(|(x, removed)| x.map(|x| x - removed)).collect(),
        removed_m,
        oscillations: Vec::new(),
        ridge: None,
        multitaper: None,
        noise_floor_m: Vec::new(),
    })
}
