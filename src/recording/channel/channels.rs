//! Channels: what of a recording is followed over the frames.

use crate::recording::Recording;
use serde::Serialize;

/// A quantity followed over the frames, m.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum Channel {
    /// Deflection of the blade, `tip_x - head_x` = `v3 - v`.
    Deflection,
    /// Drop of the head towards the glass, `-head_y` = `u`.
    HeadDrop,
    /// Lip tip along the sweep, `v3`.
    TipX,
    /// Head along the sweep, `v`.
    HeadX,
}

/// A channel name that does not exist.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown channel `{found}`; {advice}")]
pub struct UnknownChannel {
    /// The name as written.
    pub found: String,
    /// The nearest known name, or the list of them.
    pub advice: String,
}

impl Channel {
    /// Every channel, in the order of the documentation.
    pub const ALL: [Self; 4] = [Self::Deflection, Self::HeadDrop, Self::TipX, Self::HeadX];

    /// Name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Deflection => "deflection",
            Self::HeadDrop => "head-drop",
            Self::TipX => "tip-x",
            Self::HeadX => "head-x",
        }
    }

    /// The same in a sentence.
    pub(crate) fn label(self) -> String {
        self.name().replace('-', " ")
    }

    /// The channel of that [`Self::name`].
    ///
    /// # Errors
    /// [`UnknownChannel`] with the nearest known name.
    pub fn parse(text: &str) -> Result<Self, UnknownChannel> {
        let names = Self::ALL.map(Self::name);
        let channel = Self::ALL.into_iter().find(|c| c.name() == text);
        channel.ok_or_else(|| UnknownChannel {
            found: text.to_owned(),
            advice: crate::toml_file::suggest_key(text, &names),
        })
    }

    /// The channel in every frame, m; `None` where a point that it needs was not tracked.
    #[must_use]
    pub fn samples(self, recording: &Recording) -> Vec<Option<f64>> {
        let traces = recording.traces();
        match self {
            Self::Deflection => traces
                .tip_x_m
                .iter()
                .zip(&traces.head_x_m)
                .map(|(tip, head)| Some((*tip)? - (*head)?))
                .collect(),
            Self::HeadDrop => traces.head_y_m.iter().map(|y| y.map(|y| -y)).collect(),
            Self::TipX => traces.tip_x_m.clone(),
            Self::HeadX => traces.head_x_m.clone(),
        }
    }
}

impl std::str::FromStr for Channel {
    type Err = UnknownChannel;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::parse(text)
    }
}

impl std::fmt::Display for Channel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};

    #[test]
    fn a_channel_is_missing_where_any_of_its_points_is() {
        let traces = Traces {
            tip_x_m: vec![Some(3.0), None, Some(5.0)],
            tip_y_m: vec![None; 3],
            head_x_m: vec![Some(1.0), Some(1.0), None],
            head_y_m: vec![Some(-0.5), Some(0.25), None],
            ..Traces::default()
        };
        let recording =
            Recording::new("r", FrameGrid { start_s: 0.0, frame_rate_hz: 1000.0, frames: 3 }, traces, false)
                .unwrap();
        assert_eq!(Channel::Deflection.samples(&recording), [Some(2.0), None, None]);
        assert_eq!(Channel::HeadDrop.samples(&recording), [Some(0.5), Some(-0.25), None]);
    }

    #[test]
    fn names_round_trip_and_a_mistyped_one_names_the_nearest() {
        for channel in Channel::ALL {
            assert_eq!(Channel::parse(channel.name()), Ok(channel));
        }
        assert_eq!(
            Channel::parse("head_drop").unwrap_err().to_string(),
            "unknown channel `head_drop`; did you mean `head-drop`?"
        );
    }
}
