//! The two spectral components that fits are held against, read by the same code.

use super::motion::comparison_grid;
use crate::blade::modes::body_frequencies;
use crate::recording::Recording;
use crate::recording::channel::{InstantKind, ReversalInstants, Window, WindowEnd};
use crate::simulate::scene::Scene;
use crate::spectrum::{SpectrumSettings, analyse_spectrum};
use std::ops::Range;

/// Place of the low component: the head on its spring, read from the head's drop.
pub const LOW_COMPONENT: usize = 0;
/// Place of the high component: the stick-slip cycle, read from the deflection.
pub const HIGH_COMPONENT: usize = 1;

/// Frequencies between which each component is sought, in units of the head's natural frequency: the low one
/// was published at 1.5 and 3.9 times that frequency, the high one at 40 to 80 times it.
const BANDS_OVER_HEAD: [(f64, f64); 2] = [(1.0, 6.0), (6.0, 600.0)];
/// Time after the release before a window starts, s: what the flip leaves dies out.
const AFTER_RELEASE_S: f64 = 0.01;

/// The components of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ComponentPair {
    /// Frequency of the low and the high component, Hz; `None` where there is none.
    pub hz: [Option<f64>; 2],
}

/// What is read from every run: the same frames, whenever its own tip was released.
#[derive(Debug, Clone, PartialEq)]
pub struct ComponentReader {
    frames: Range<usize>,
    frame_rate_hz: f64,
    bands_hz: [(f64, f64); 2],
}

impl ComponentReader {
    /// From the release that the reference shows to its end; all of it where it shows none.
    pub fn from_reference(scene: &Scene, reference: Option<&Recording>) -> Self {
        let from = WindowEnd::Found { anchor: InstantKind::Release, reversal: 1, offset_s: AFTER_RELEASE_S };
        let window = Window { from, to: WindowEnd::Open };
        let released = reference.and_then(|recording| {
            window.resolve_frames(recording, &ReversalInstants::find_instants(recording)).ok()
        });
        let frames = released.unwrap_or(0..reference.map_or(0, |recording| recording.grid().frames));
        let head_hz = body_frequencies(&scene.linkage).head_hz;
        let frame_rate_hz = comparison_grid(scene).frame_rate_hz;
        let bands_hz =
            BANDS_OVER_HEAD.map(|(low, high)| (low * head_hz, (high * head_hz).min(frame_rate_hz / 2.0)));
        Self { frames, frame_rate_hz, bands_hz }
    }

    /// The components of a run, of which each column has one sample a frame, m.
    pub fn read_components(&self, deflection_m: &[f64], head_drop_m: &[f64]) -> ComponentPair {
        let strongest = |column: &[f64], (low, high): (f64, f64)| {
            let inside: Vec<Option<f64>> =
                column.get(self.frames.clone())?.iter().map(|x| Some(*x)).collect();
            let settings = SpectrumSettings { band_hz: Some((low, high)), ..SpectrumSettings::default() };
            let spectrum = analyse_spectrum(&inside, self.frame_rate_hz, &settings).ok()?;
            spectrum.component_in_band(low, high).map(|c| c.frequency_hz)
        };
        ComponentPair {
            hz: [
                strongest(head_drop_m, self.bands_hz[LOW_COMPONENT]),
                strongest(deflection_m, self.bands_hz[HIGH_COMPONENT]),
            ],
        }
    }
}
