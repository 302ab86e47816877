//! Recording and model on one clock and with one origin.
//!
//! After a fit to traces, the model is seen through the fitted camera, and the recording is that which the
//! fit compares. Otherwise clock and origin of the model are shifted so that its head follows the recorded
//! head.

use super::model_run::ModelRun;
use crate::fit::trace::FittedTraces;
use crate::recording::alignment::{Alignment, AlignmentPoint};
use crate::recording::motion_traces::{MotionTraces, subtract_columns};
use crate::recording::{FrameGrid, Recording, Traces};
use crate::simulate::twin::TwinView;

impl ModelRun {
    /// Offsets of the model's clock and positions from those of a recording.
    pub(crate) fn alignment(&self, recording: &Recording) -> Alignment {
        match &self.traces {
            Some(traces) => traces_alignment(traces),
            None => Alignment::estimate(recording, &self.view.recording),
        }
    }

    /// Motion of a recording as it is compared with this run. The deflection is counted from the path of the
    /// model's head if the recorded head drives the model, since this path is smooth.
    pub(crate) fn measured_motion(&self, recording: &Recording) -> MotionTraces {
        let mut motion = MotionTraces::from_recording(recording);
        let Some(traces) = &self.traces else { return motion };
        motion.head_x_m.clone_from(&traces.measured_head_x_m);
        let [tip, drop] = &traces.measured;
        if tip.iter().any(Option::is_some) {
            motion.tip_x_m.clone_from(tip);
            if traces.own_head {
                motion.deflection_m = subtract_columns(tip, &traces.head_x_m);
            }
        }
        if drop.iter().any(Option::is_some) {
            motion.head_drop_m.clone_from(drop);
        }
        motion
    }

    /// Motion of the model that restarts at every segment of the fit, with values in the fitted frames. Its
    /// deflection is counted as in [`Self::measured_motion`], and its head position is left out. `None`
    /// without fitted traces.
    pub(crate) fn restarted_motion(&self, recording: &Recording) -> Option<MotionTraces> {
        let traces = self.traces.as_ref()?;
        let [tip_x_m, head_drop_m] = traces.restarted.clone();
        let empty = || vec![None; tip_x_m.len()];
        let deflection_m =
            if traces.own_head { subtract_columns(&tip_x_m, &traces.head_x_m) } else { empty() };
        let time_s = MotionTraces::from_recording(recording).time_s;
        Some(MotionTraces { time_s, head_x_m: empty(), deflection_m, tip_x_m, head_drop_m })
    }
}

fn traces_alignment(traces: &FittedTraces) -> Alignment {
    let [along_m, tip_m, drop_m] = traces.offsets_m;
    Alignment {
        shift_s: traces.clock_s,
        along_m,
        tip_m,
        drop_m,
        followed: if traces.own_head { AlignmentPoint::Head } else { AlignmentPoint::Tip },
        shift_sd_s: None,
        opposite_turn: false,
    }
}

/// The view of a run through the fitted camera, in the frames of the recording. The constant offsets of the
/// camera are removed, because the alignment contains them. `None` if the run has fewer than two frames.
pub(super) fn view_through_camera(view: &TwinView, traces: &FittedTraces) -> Option<Recording> {
    let alignment = traces_alignment(traces);
    let grid = FrameGrid { start_s: traces.grid.start_s - traces.clock_s, ..traces.grid };
    let less = |column: &[Option<f64>], offset_m: f64| -> Vec<Option<f64>> {
        column.iter().map(|x| x.map(|x| x - offset_m)).collect()
    };
    let [tip, drop] = &traces.single_run;
    let height = |i| view.recording.interpolate_column(&view.recording.traces().tip_y_m, grid.time_s(i));
    let shown = Traces {
        tip_x_m: less(tip, alignment.along_m + alignment.tip_m),
        tip_y_m: (0..grid.frames).map(height).collect(),
        head_x_m: less(&traces.head_x_m, alignment.along_m),
        head_y_m: less(drop, alignment.drop_m).into_iter().map(|drop| drop.map(|drop| -drop)).collect(),
        ..Traces::default()
    };
    let enough = shown.tip_x_m.iter().flatten().count() >= 2;
    let recording = Recording::new(view.recording.name(), grid, shown, view.recording.is_synthetic());
    recording.ok().filter(|_| enough)
}
