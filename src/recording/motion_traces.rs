//! The four channels of a motion over time, and the residual of a recording from its model.

use super::alignment::Alignment;
use crate::recording::Recording;
use crate::recording::channel::Channel;
use serde::Serialize;

/// Motion over time; all columns are as long as `time_s`, with `None` for a missing point.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct MotionTraces {
    /// Times of the samples, s.
    pub time_s: Vec<f64>,
    /// Position of the lip tip along the sweep, m.
    pub tip_x_m: Vec<Option<f64>>,
    /// Position of the head along the sweep, m.
    pub head_x_m: Vec<Option<f64>>,
    /// Deflection of the blade, m.
    pub deflection_m: Vec<Option<f64>>,
    /// Drop of the head, m.
    pub head_drop_m: Vec<Option<f64>>,
}

/// The channels in the order of their panels in a figure.
pub(crate) const MOTION_CHANNELS: [Channel; 4] =
    [Channel::TipX, Channel::HeadX, Channel::Deflection, Channel::HeadDrop];

/// A column minus another one, frame by frame; missing if either is missing.
pub(crate) fn subtract_columns(a: &[Option<f64>], b: &[Option<f64>]) -> Vec<Option<f64>> {
    a.iter().zip(b).map(|(a, b)| Some((*a)? - (*b)?)).collect()
}

impl MotionTraces {
    /// Motion of a recording, on its own clock.
    pub(crate) fn from_recording(recording: &Recording) -> Self {
        Self::from_columns(recording, |channel| channel.samples(recording))
    }

    /// Motion of a model, with the clock and the origin of a recording.
    pub(crate) fn from_model(model: &Recording, alignment: &Alignment) -> Self {
        let mut moved = Self::from_columns(model, |channel| {
            let by_m = alignment.offset_m(channel);
            channel.samples(model).into_iter().map(|x| Some(x? + by_m)).collect()
        });
        moved.time_s.iter_mut().for_each(|t| *t += alignment.shift_s);
        moved
    }

    /// Motion of a model at the frames of a recording, with the clock and the origin of the recording.
    pub(crate) fn from_model_at_frames(
        recording: &Recording,
        model: &Recording,
        alignment: &Alignment,
    ) -> Self {
        let grid = recording.grid();
        Self::from_columns(recording, |channel| {
            let (of_model, by_m) = (channel.samples(model), alignment.offset_m(channel));
            let time_s = |i| grid.time_s(i) - alignment.shift_s;
            let at = |i| Some(model.interpolate_column(&of_model, time_s(i))? + by_m);
            (0..grid.frames).map(at).collect()
        })
    }

    /// This motion minus another one in the same frames; missing if either is missing.
    pub(crate) fn subtract(&self, other: &Self) -> Self {
        let less = |channel: Channel| subtract_columns(self.column(channel), other.column(channel));
        Self {
            time_s: self.time_s.clone(),
            tip_x_m: less(Channel::TipX),
            head_x_m: less(Channel::HeadX),
            deflection_m: less(Channel::Deflection),
            head_drop_m: less(Channel::HeadDrop),
        }
    }

    fn from_columns(recording: &Recording, column: impl Fn(Channel) -> Vec<Option<f64>>) -> Self {
        let grid = recording.grid();
        Self {
            time_s: (0..grid.frames).map(|i| grid.time_s(i)).collect(),
            tip_x_m: column(Channel::TipX),
            head_x_m: column(Channel::HeadX),
            deflection_m: column(Channel::Deflection),
            head_drop_m: column(Channel::HeadDrop),
        }
    }

    pub(crate) fn column(&self, channel: Channel) -> &[Option<f64>] {
        match channel {
            Channel::TipX => &self.tip_x_m,
            Channel::HeadX => &self.head_x_m,
            Channel::Deflection => &self.deflection_m,
            Channel::HeadDrop => &self.head_drop_m,
        }
    }

    /// Root mean square of a channel between two instants, s, or over the whole motion; `None` without a
    /// value.
    pub(crate) fn rms_m(&self, channel: Channel, within_s: Option<(f64, f64)>) -> Option<f64> {
        let inside = |t: f64| within_s.is_none_or(|(from, to)| t >= from && t <= to);
        let frames = self.time_s.iter().zip(self.column(channel)).filter(|(t, _)| inside(**t));
        let squares: Vec<f64> = frames.filter_map(|(_, x)| x.map(|x| x * x)).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    }
}
