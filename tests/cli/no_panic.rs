//! No record, however broken, makes the search for instants or components panic.

use proptest::prelude::*;
use short_spectra::{SpectrumSettings, analyse_spectrum};
use wiperlab::recording::channel::{Channel, ReversalInstants, Window};
use wiperlab::recording::{FrameGrid, Recording, Traces};

fn column(frames: usize) -> impl Strategy<Value = Vec<Option<f64>>> {
    let wild = prop_oneof![4 => (-1.0..1.0f64).prop_map(Some), 3 => (-3i32..3).prop_map(|i| Some(f64::from(i) * 1e-3)), 2 => Just(None), 1 => Just(Some(9e5)), 1 => Just(Some(-9e5))];
    prop::collection::vec(wild, frames)
}

proptest! {
    #[test]
    fn any_recording_has_instants_in_order_or_none((tip, head) in (2..200usize).prop_flat_map(|n| (column(n), column(n)))) {
        let frames = tip.len();
        let traces = Traces { tip_x_m: tip, tip_y_m: vec![None; frames], head_x_m: head, head_y_m: vec![None; frames], ..Traces::default() };
        let recording = Recording::new("r", FrameGrid { start_s: 0.0, frame_rate_hz: 1000.0, frames }, traces, true).unwrap();
        let found = ReversalInstants::find_instants(&recording);
        prop_assert!(found.reversals.windows(2).all(|w| w[0].reversal_s <= w[1].reversal_s));
        prop_assert!(found.reversals.iter().all(|r| r.reversal_s.is_finite()));
        let _ = Window::parse("hold..release").unwrap().resolve_frames(&recording, &found);
        let _ = analyse_spectrum(&Channel::TipX.samples(&recording), 1000.0, &SpectrumSettings::default());
    }

    #[test]
    fn any_usable_record_has_a_finite_spectrum(samples in (8..300usize).prop_flat_map(|n| prop::collection::vec(prop::option::weighted(0.8, -1.0..1.0f64), n))) {
        if let Ok(found) = analyse_spectrum(&samples, 1000.0, &SpectrumSettings::default()) {
            prop_assert!(found.amplitude_m.iter().all(|a| a.is_finite()) && found.noise_floor_m.is_finite());
            prop_assert!(found.components.iter().all(|c| c.frequency_sd_hz.is_finite() && c.amplitude_m.is_finite() && c.snr_db.is_finite()));
        }
    }

    #[test]
    fn any_text_is_a_window_or_a_refusal(text in ".{0,20}") {
        let _ = Window::parse(&text);
    }
}
