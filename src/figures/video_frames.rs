//! The links of the fitted model drawn over frames of the video, at instants of the reversal.

use super::FigureText;
use super::poses::{joint_positions, reversal_poses};
use crate::compare::ConditionComparison;
use crate::figures::{FigureBlock, subtitle};
use crate::recording::video::RecordingVideo;
use crate::text::{format_length, join_with_and};
use plain_charts::{ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Raster, Series};
use portable_math as math;

/// The instants to show: name of the model's pose, and name of the instant in the figure.
const SHOWN: [(&str, &str); 4] = [
    ("before", "before the reversal"),
    ("upright", "in the flip"),
    ("still stuck", "at the release"),
    ("after", "after the flip"),
];
/// Largest allowed distance, in frames, from an instant of the model to the nearest frame in which head and
/// tip are tracked.
const NEAR: usize = 5;
/// Height of a panel, mm.
const DRAWING_MM: f64 = 42.0;
/// Number of pixels across a panel.
const FRAME_POINTS: usize = 256;
/// Half width, about the head, of the part of the video frame that is resampled, in lengths of the blade;
/// larger than any panel.
const FRAME_HALF: f64 = 1.5;
/// Heights above the glass of the lower and upper end of the part of the video frame that is resampled, in
/// lengths of the blade.
const FRAME_HEIGHTS: [f64; 2] = [-0.3, 1.3];
/// Margin around the links, in lengths of the blade.
const ROOM: f64 = 0.12;

/// The video frame of an instant.
#[derive(Debug, Clone, PartialEq)]
pub enum Frame {
    /// The video has no picture of the instant.
    Missing,
    /// The picture contains neither the head nor the tip of the model.
    Elsewhere,
    /// The part of the picture around the links, in mm of the figure.
    Shown(Raster),
}

impl Frame {
    /// The picture; `None` if there is none or if it does not show the links.
    #[must_use]
    pub fn raster(&self) -> Option<&Raster> {
        match self {
            Self::Shown(raster) => Some(raster),
            Self::Missing | Self::Elsewhere => None,
        }
    }
}

/// A frame of the recording with the pose of the model. Each position is a pair, m: the distance along the
/// sweep from the model's head, and the height above the glass.
#[derive(Debug, Clone, PartialEq)]
pub struct Instant {
    /// Name of the event, such as `upright`.
    pub name: &'static str,
    /// Time of the frame on the clock of the recording, s.
    pub time_s: f64,
    /// Head, hinge and tip of the model.
    pub joints_m: [(f64, f64); 3],
    /// The tracked head and tip; a point without a tracked height has the height of the model's point.
    pub tracked_m: [(f64, f64); 2],
    /// The frame of the video.
    pub frame: Frame,
}

impl Instant {
    /// Distances between tracked and modelled position of head and tip, m, each with the name of the point.
    fn distances_m(&self) -> [(&'static str, f64); 2] {
        let [head, _, tip] = self.joints_m;
        let apart = |(x, y): (f64, f64), (to_x, to_y): (f64, f64)| math::hypot(to_x - x, to_y - y);
        [("head", apart(head, self.tracked_m[0])), ("tip", apart(tip, self.tracked_m[1]))]
    }
}

/// Data of the figure.
#[derive(Debug, Clone, PartialEq)]
pub struct VideoFrames {
    /// Line under the heading.
    pub subtitle: String,
    /// The instants, in order of time.
    pub instants: Vec<Instant>,
}

impl VideoFrames {
    /// The instants of a condition that its recording contains; `None` if there are none, without a video, or
    /// if the heads of recording and model turn in opposite directions.
    #[must_use]
    pub fn of(case: &ConditionComparison) -> Option<Self> {
        let film = case.measured?.film.filter(|_| !case.alignment.opposite_turn)?;
        let poses = reversal_poses(&case.model.motion);
        let shown = |(pose, name): (&str, &'static str)| {
            let time_s = poses.iter().find(|p| p.name == pose)?.sample.time_s;
            instant(case, &film, name, time_s + case.alignment.shift_s)
        };
        let instants: Vec<Instant> = SHOWN.into_iter().filter_map(shown).collect();
        (!instants.is_empty()).then(|| Self { subtitle: subtitle(case.is_synthetic(), ""), instants })
    }
}

/// The tracked frame nearest to a time, s, of the recording. `None` if no height was tracked, since the place
/// of the links in the picture is then unknown.
fn instant(
    case: &ConditionComparison,
    film: &RecordingVideo<'_>,
    name: &'static str,
    time_s: f64,
) -> Option<Instant> {
    let recording = case.recording()?;
    let (grid, traces, view) = (recording.grid(), recording.traces(), &case.model.view.recording);
    let nearest = ((time_s - grid.start_s) * grid.frame_rate_hz).round();
    let has = |at: &usize| {
        let value = |column: &[Option<f64>]| column.get(*at).copied().flatten().is_some();
        value(&traces.tip_x_m) && value(&traces.head_x_m)
    };
    let frames = (0..=NEAR).flat_map(|away| [nearest - away as f64, nearest + away as f64]);
    let at = frames.filter(|at| (0.0..grid.frames as f64).contains(at)).map(|at| at as usize).find(has)?;
    let time_s = grid.time_s(at);
    let model_s = time_s - case.alignment.shift_s;
    // measured minus model at the instant, minus the offset that aligns the model
    let apart_m = |measured: &[Option<f64>], model: &[Option<f64>], added_m: f64| {
        Some((*measured.get(at)?)? - view.interpolate_column(model, model_s)? - added_m)
    };
    let (seen, along_m, drop_m) = (view.traces(), case.alignment.along_m, case.alignment.drop_m);
    let fine = &case.model.motion.fine;
    let after = fine.partition_point(|sample| sample.time_s < model_s);
    let joints_m = joint_positions(&case.model.motion.linkage, fine.get(after).or(fine.last())?);
    let joints_m = joints_m.map(|(x, y)| (x - joints_m[0].0, y));
    let head_up_m = apart_m(&traces.head_y_m, &seen.head_y_m, -drop_m);
    let tip_up_m = apart_m(&traces.tip_y_m, &seen.tip_y_m, -drop_m);
    let [head, _, tip] = joints_m;
    let head_on_m = apart_m(&traces.head_x_m, &seen.head_x_m, along_m)?;
    let tip_on_m = apart_m(&traces.tip_x_m, &seen.tip_x_m, along_m)?;
    let tracked_m = [
        (head.0 + head_on_m, head.1 + head_up_m.unwrap_or_default()),
        (tip.0 + tip_on_m, tip.1 + tip_up_m.unwrap_or_default()),
    ];
    // shift from the coordinates of the figure to those of the recording
    let from = |column: &[Option<f64>], at_m: f64| Some((*column.get(at)?)? - at_m);
    let by_head = head_up_m.and_then(|_| from(&traces.head_y_m, tracked_m[0].1));
    let by_tip = tip_up_m.and_then(|_| from(&traces.tip_y_m, tracked_m[1].1));
    let shift_m = (from(&traces.head_x_m, tracked_m[0].0)?, by_head.or(by_tip)?);
    let frame = photograph(film, at, &joints_m, shift_m);
    Some(Instant { name, time_s, joints_m, tracked_m, frame })
}

/// The part of frame `at` around the links, resampled to the axes of the figure.
fn photograph(
    film: &RecordingVideo<'_>,
    at: usize,
    joints_m: &[(f64, f64); 3],
    shift_m: (f64, f64),
) -> Frame {
    let Some(picture) = film.pictures.frame_picture(at) else { return Frame::Missing };
    let ends = [joints_m[0], joints_m[2]];
    let seen = |(x_m, y_m)| picture.contains_point(film.mapping.to_pixel([x_m + shift_m.0, y_m + shift_m.1]));
    if !ends.into_iter().any(seen) {
        return Frame::Elsewhere;
    }
    let size_m = joints_m[0].1;
    let (half_m, [low_m, high_m]) = (FRAME_HALF * size_m, FRAME_HEIGHTS.map(|height| height * size_m));
    let point_m = 2.0 * half_m / FRAME_POINTS as f64;
    let rows = ((high_m - low_m) / point_m).round() as usize;
    let pixel = |[across, down]: [f64; 2]| {
        let (x_m, y_m) = (across * point_m - half_m, high_m - down * point_m);
        film.mapping.to_pixel([x_m + shift_m.0, y_m + shift_m.1])
    };
    let Ok(png) = picture.resample(FRAME_POINTS, rows, pixel).to_png() else { return Frame::Missing };
    let y = [high_m - rows as f64 * point_m, high_m].map(|y_m| 1e3 * y_m);
    Frame::Shown(Raster { png, x: [-1e3 * half_m, 1e3 * half_m], y })
}

/// The figure of a condition; `None` without a video, or if nothing was tracked at the instants.
pub(crate) fn block(case: &ConditionComparison) -> Option<FigureBlock> {
    let shown = VideoFrames::of(case)?;
    let words = FigureText { caption: caption(&shown), details: details(&shown) };
    Some(case.figure_block("video-frames", words, figure(&shown)))
}

/// The tracked point that is farthest from the model: its instant, its name and its distance, m.
fn farthest(shown: &VideoFrames) -> Option<(&Instant, &'static str, f64)> {
    let points = shown.instants.iter().flat_map(|i| i.distances_m().map(|(point, m)| (i, point, m)));
    points.max_by(|a, b| a.2.total_cmp(&b.2))
}

/// Caption: one sentence on the figure.
pub(crate) fn caption(shown: &VideoFrames) -> String {
    let Some((instant, point, distance_m)) = farthest(shown) else { return String::new() };
    format!(
        "At {} instants through the reversal head and tip of the model lie at most {} from the tracked points: the \
         {point} {}.",
        shown.instants.len(),
        format_length(distance_m),
        instant.name,
    )
}

/// Details under the caption.
#[must_use]
pub fn details(shown: &VideoFrames) -> String {
    format!("Shown: the links of the model, and the tracked points.{}", frames_in_words(shown))
}

/// Sentences on the instants with and without a video frame.
fn frames_in_words(shown: &VideoFrames) -> String {
    let of = |is: fn(&Frame) -> bool| -> Vec<String> {
        shown.instants.iter().filter(|i| is(&i.frame)).map(|i| i.name.to_owned()).collect()
    };
    let with = of(|frame| frame.raster().is_some());
    let (without, elsewhere) = (of(|frame| *frame == Frame::Missing), of(|frame| *frame == Frame::Elsewhere));
    let mut words = match (with.is_empty(), without.is_empty()) {
        (true, true) => String::new(),
        (true, false) => format!(
            " The video has no picture {}: check `first_frame` of [video] in recording.toml.",
            join_with_and(&without)
        ),
        (false, true) => " Behind them the frames of the video.".to_owned(),
        (false, false) => {
            let without = join_with_and(&without);
            format!(" Behind them the frames of the video, of which there is none {without}.")
        }
    };
    if !elsewhere.is_empty() {
        words += &format!(
            " The frame {} shows neither tracked point: check `origin_px` and `metres_per_pixel` of [video] in \
             recording.toml.",
            join_with_and(&elsewhere)
        );
    }
    words
}

/// Draws the links at every instant.
#[must_use]
pub fn figure(shown: &VideoFrames) -> Figure {
    Figure {
        title: farthest(shown).map_or_else(String::new, |(.., distance_m)| {
            format!("The model's links end within {} of the tracked points", format_length(distance_m))
        }),
        subtitle: shown.subtitle.clone(),
        watermarked: false, // (marked by the caller if the data are synthetic)
        description: caption(shown),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels: shown.instants.iter().map(|i| drawing(shown, i)).collect(),
    }
}

/// The panel of an instant: the two links with the tracked points, mm.
fn drawing(shown: &VideoFrames, instant: &Instant) -> Panel {
    let place = |(x, y): (f64, f64)| Some((1e3 * x, 1e3 * y));
    let [head, hinge, tip] = instant.joints_m;
    let [(_, head_m), (_, tip_m)] = instant.distances_m();
    // the same scale at all instants
    let all = || shown.instants.iter().flat_map(|i| i.joints_m);
    let size = all().map(|(_, y)| y).fold(0.0, f64::max);
    let half = all().map(|(x, _)| x.abs()).fold(0.0, f64::max) + ROOM * size;
    // white edges make lines and points visible on any picture
    let filmed = instant.frame.raster().is_some();
    let look = |plain: Mark| if filmed { Mark::Edged } else { plain };
    let [tracked_head, tracked_tip] = instant.tracked_m.map(place);
    let tracked = [tracked_head, None, tracked_tip].into_iter().filter(|point| filmed || point.is_some());
    let series = [
        Series::new("glass", Colour::Grey, Mark::Thin, [(-1e6, 0.0), (1e6, 0.0)]),
        Series::new("neck", Colour::Blue, look(Mark::Thick), [place(head), place(hinge)]),
        Series::new("lip", Colour::Orange, look(Mark::Thick), [place(hinge), place(tip)]),
        Series::new("tracked head and tip", Colour::Black, look(Mark::Circles), tracked),
    ];
    let x = ChartAxis::linear("from the head, mm").with_range(-1e3 * half, 1e3 * half);
    let y = ChartAxis::linear("over the glass, mm");
    let y = y.with_range(-1e3 * ROOM * size, 1e3 * (1.0 + ROOM) * size);
    Panel {
        title: format!("{}\ntip {}, head {}", instant.name, format_length(tip_m), format_length(head_m)),
        equal_aspect: true,
        raster: instant.frame.raster().cloned(),
        ..Panel::new(x, y, DRAWING_MM, series)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plain_charts::{MAX_HEIGHT_MM, Medium};

    #[test]
    fn every_instant_has_its_links_and_the_farthest_point_is_named() {
        let instant = |name, tip_m| Instant {
            name,
            time_s: 0.1,
            joints_m: [(0.0, 5e-3), (1e-3, 3e-3), (2.5e-3, 0.0)],
            tracked_m: [(1e-6, 5e-3), tip_m],
            frame: Frame::Missing,
        };
        let shown = VideoFrames {
            subtitle: "synthetic".to_owned(),
            instants: vec![
                instant("in the flip", (2.503e-3, 4e-6)),
                instant("after the flip", (2.502e-3, 0.0)),
            ],
        };
        let drawn = figure(&shown);
        assert_eq!((drawn.panels.len(), drawn.columns), (2, 2));
        assert!(drawn.panels.iter().all(|panel| panel.equal_aspect));
        assert!(drawn.height_mm(Medium::Column) <= MAX_HEIGHT_MM);
        let svg = drawn.to_svg(Medium::Page);
        assert!(
            svg.contains("tip 5.0 \u{b5}m, head 1.0 \u{b5}m")
                && svg.contains("synthetic")
                && !svg.contains("NaN")
        );
        assert!(
            caption(&shown).ends_with("at most 5.0 \u{b5}m from the tracked points: the tip in the flip.")
        );
    }
}
