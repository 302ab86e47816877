//! The links of the fitted model over the tracked points, at instants through the reversal, and how far the
//! two lie apart, enlarged.

use super::naming::Words;
use super::poses::{joints, through_reversal};
use crate::compare::Case;
use crate::math;
use crate::recording::channel::Channel;
use crate::recording::film::Film;
use crate::report::chart::{Axis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Raster, Series, Shape};
use crate::report::{FigureBlock, subtitle};
use crate::text::{decimals, digits, length, listed, short};
use std::f64::consts::TAU;

/// The instants that are shown: the pose of the model, and what it is called over a recording.
const SHOWN: [(&str, &str); 4] = [
    ("before", "before the reversal"),
    ("upright", "in the flip"),
    ("still stuck", "at the release"),
    ("after", "after the flip"),
];
/// Most frames between an instant of the model and a frame that has head and tip.
const NEAR: usize = 5;
/// Standard deviations of the noise in an ellipse.
const ELLIPSE: f64 = 2.0;
const ELLIPSE_POINTS: u32 = 28;
/// Height of a panel, mm.
const DRAWING_MM: f64 = 42.0;
/// Points of a frame of the video across a panel, and the part of it that is shown, in lengths of the blade:
/// to either side of the head, and over the glass. A panel of any width lies within it.
const FRAME_POINTS: usize = 256;
const FRAME_HALF: f64 = 1.5;
const FRAME_HEIGHTS: [f64; 2] = [-0.3, 1.3];
/// Room round the links, in lengths of the blade, and round what lies apart.
const ROOM: f64 = 0.12;
const ENLARGED_ROOM: f64 = 1.2;

/// Tracked minus model, m; upwards `None` where only the sweep was tracked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Apart {
    /// Along the sweep.
    pub along_m: f64,
    /// Upwards.
    pub up_m: Option<f64>,
}

impl Apart {
    /// The distance, m.
    #[must_use]
    pub fn distance_m(&self) -> f64 {
        math::hypot(self.along_m, self.up_m.unwrap_or_default())
    }

    /// Root mean square over the tracked directions of what lies apart, each in standard deviations of its
    /// noise: about 1 where noise is all that lies between.
    #[must_use]
    pub fn over_noise(&self, noise_m: [f64; 2]) -> f64 {
        let along = math::powi(self.along_m / noise_m[0], 2);
        let up = self.up_m.map(|up_m| math::powi(up_m / noise_m[1], 2));
        up.map_or(along, |up| (along + up) / 2.0).sqrt()
    }
}

/// What there is of the video at an instant.
#[derive(Debug, Clone, PartialEq)]
pub enum Frame {
    /// There is no video.
    None,
    /// No picture of the instant.
    Missing,
    /// A picture that shows neither the tracked head nor the tip.
    Elsewhere,
    /// The part round the links, in mm of the figure.
    Shown(Raster),
}

impl Frame {
    /// The picture, where it shows the links.
    #[must_use]
    pub fn shown(&self) -> Option<&Raster> {
        match self {
            Self::Shown(raster) => Some(raster),
            Self::None | Self::Missing | Self::Elsewhere => None,
        }
    }
}

/// A frame of the recording with the model in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Instant {
    /// What happens then.
    pub name: &'static str,
    /// Time of the frame, s of the recording.
    pub time_s: f64,
    /// Head, hinge and tip of the model, along the sweep from its head and over the glass, m.
    pub joints_m: [(f64, f64); 3],
    /// The tracked head minus the model's.
    pub head: Apart,
    /// The tracked tip minus the model's.
    pub tip: Apart,
    /// The frame of the video.
    pub frame: Frame,
}

/// What the figure shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Linkage {
    /// Line under the heading.
    pub subtitle: String,
    /// The instants, in their order.
    pub instants: Vec<Instant>,
    /// Standard deviations of the noise along the sweep and upwards, m.
    pub noise_m: [f64; 2],
}

impl Linkage {
    /// The instants of a condition that its recording shows; `None` without any, or without noise to compare
    /// with.
    #[must_use]
    pub fn of(case: &Case) -> Option<Self> {
        let along_m = case.noise_m(Channel::TipX)?;
        let noise_m = [along_m, case.noise_m(Channel::HeadDrop).unwrap_or(along_m)];
        if case.alignment.opposite_turn {
            return None;
        }
        let poses = through_reversal(&case.model.motion);
        let shown = |(pose, name): (&str, &'static str)| {
            let time_s = poses.iter().find(|p| p.name == pose)?.sample.time_s;
            instant(case, name, time_s + case.alignment.shift_s)
        };
        let instants: Vec<Instant> = SHOWN.into_iter().filter_map(shown).collect();
        let subtitle = subtitle(case.synthetic(), "");
        (!instants.is_empty()).then_some(Self { subtitle, instants, noise_m })
    }
}

/// The frame with head and tip that is nearest to a time of the recording, s.
fn instant(case: &Case, name: &'static str, time_s: f64) -> Option<Instant> {
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
    // (measured, model, what is added to the model)
    let apart = |measured: &[Option<f64>], model: &[Option<f64>], added_m: f64| {
        Some((*measured.get(at)?)? - view.at(model, model_s)? - added_m)
    };
    let (seen, along_m, drop_m) = (view.traces(), case.alignment.along_m, case.alignment.drop_m);
    let fine = &case.model.motion.fine;
    let after = fine.partition_point(|sample| sample.time_s < model_s);
    let joints_m = joints(&case.model.motion.linkage, fine.get(after).or(fine.last())?);
    let head = Apart {
        along_m: apart(&traces.head_x_m, &seen.head_x_m, along_m)?,
        up_m: apart(&traces.head_y_m, &seen.head_y_m, -drop_m),
    };
    let joints_m = joints_m.map(|(x, y)| (x - joints_m[0].0, y));
    let tip = Apart {
        along_m: apart(&traces.tip_x_m, &seen.tip_x_m, along_m)?,
        up_m: apart(&traces.tip_y_m, &seen.tip_y_m, -drop_m),
    };
    // from the place of the tracked points in the figure to that in the recording
    let from = |column: &[Option<f64>], at_m: f64| Some((*column.get(at)?)? - at_m);
    let up = |column: &[Option<f64>], y_m: f64, apart: Apart| from(column, y_m + apart.up_m?);
    let up_m = up(&traces.head_y_m, joints_m[0].1, head).or(up(&traces.tip_y_m, joints_m[2].1, tip));
    let shift_m = from(&traces.head_x_m, joints_m[0].0 + head.along_m).zip(up_m);
    let film = case.measured.and_then(|measured| measured.film);
    let frame = film.zip(shift_m).map(|(film, shift_m)| photograph(&film, at, &joints_m, shift_m));
    let frame = frame.unwrap_or(Frame::None);
    Some(Instant { name, time_s, joints_m, head, frame, tip })
}

/// The frame `at` round the links, turned and scaled as the figure.
fn photograph(film: &Film<'_>, at: usize, joints_m: &[(f64, f64); 3], shift_m: (f64, f64)) -> Frame {
    let Some(picture) = film.pictures.picture(at) else { return Frame::Missing };
    let ends = [joints_m[0], joints_m[2]];
    let seen = |(x_m, y_m)| picture.holds(film.place.pixel([x_m + shift_m.0, y_m + shift_m.1]));
    if !ends.into_iter().any(seen) {
        return Frame::Elsewhere;
    }
    let size_m = joints_m[0].1;
    let (half_m, [low_m, high_m]) = (FRAME_HALF * size_m, FRAME_HEIGHTS.map(|height| height * size_m));
    let point_m = 2.0 * half_m / FRAME_POINTS as f64;
    let rows = ((high_m - low_m) / point_m).round() as usize;
    let pixel = |[across, down]: [f64; 2]| {
        let (x_m, y_m) = (across * point_m - half_m, high_m - down * point_m);
        film.place.pixel([x_m + shift_m.0, y_m + shift_m.1])
    };
    let Ok(png) = picture.cut(FRAME_POINTS, rows, pixel).to_png() else { return Frame::None };
    let y = [high_m - rows as f64 * point_m, high_m].map(|y_m| 1e3 * y_m);
    Frame::Shown(Raster { png, x: [-1e3 * half_m, 1e3 * half_m], y })
}

/// The figure of a condition; `None` where nothing was tracked at the instants.
pub(in crate::report) fn block(case: &Case) -> Option<FigureBlock> {
    let shown = Linkage::of(case)?;
    let words = Words { caption: caption(&shown), details: details(&shown) };
    Some(case.block("linkage", words, figure(&shown)))
}

/// The point that lies farthest from the model, in units of the noise.
fn worst(shown: &Linkage) -> Option<(&Instant, &'static str, Apart)> {
    let points = shown.instants.iter().flat_map(|i| [(i, "tip", i.tip), (i, "head", i.head)]);
    points.max_by(|a, b| a.2.over_noise(shown.noise_m).total_cmp(&b.2.over_noise(shown.noise_m)))
}

/// One sentence on the figure.
#[must_use]
pub fn caption(shown: &Linkage) -> String {
    let Some((instant, point, apart)) = worst(shown) else { return String::new() };
    format!(
        "At {} instants through the reversal head and tip of the model lie at most {} times the noise from the tracked \
         points: {}, the {point} by {}.",
        shown.instants.len(),
        digits(apart.over_noise(shown.noise_m), 2),
        instant.name,
        length(apart.distance_m())
    )
}

/// The rest of what is said of the figure.
#[must_use]
pub fn details(shown: &Linkage) -> String {
    let [along, up] = shown.noise_m.map(length);
    format!(
        "The two links of the model to scale, with its head at 0, and the tracked points; below, what lies between, \
         enlarged. Ellipses: {} standard deviations of the noise ({along} along the sweep, {up} upwards). \
         Distances in units of the noise (sd) are root mean squares over the two directions: about 1 where noise is all \
         that lies between.{}",
        short(ELLIPSE),
        frames_in_words(shown)
    )
}

/// Which instants have a frame of the video.
fn frames_in_words(shown: &Linkage) -> String {
    let of = |is: fn(&Frame) -> bool| {
        let names = shown.instants.iter().filter(|i| is(&i.frame)).map(|i| i.name.to_owned());
        names.collect::<Vec<String>>()
    };
    let with = of(|frame| frame.shown().is_some());
    let (without, elsewhere) = (of(|frame| *frame == Frame::Missing), of(|frame| *frame == Frame::Elsewhere));
    let mut words = match (with.is_empty(), without.is_empty()) {
        (true, true) => String::new(),
        (true, false) => format!(
            " The video has no picture {}: check `first_frame` of [video] in recording.toml.",
            listed(&without)
        ),
        (false, true) => " Behind them the frames of the video.".to_owned(),
        (false, false) => {
            format!(" Behind them the frames of the video, of which there is none {}.", listed(&without))
        }
    };
    if !elsewhere.is_empty() {
        words += &format!(
            " The frame {} shows neither tracked point: check `origin_px` and `metres_per_pixel` of [video] in \
             recording.toml.",
            listed(&elsewhere)
        );
    }
    words
}

/// The figure: the links at every instant, then what lies between.
#[must_use]
pub fn figure(shown: &Linkage) -> Figure {
    let claim = worst(shown).map(|(_, _, apart)| digits(apart.over_noise(shown.noise_m), 2));
    let enlarged = [enlarged(shown, "tip", |i| i.tip), enlarged(shown, "head", |i| i.head)];
    Figure {
        title: claim.map_or_else(String::new, |times| {
            format!("The model's links end within {times} times the noise of the tracked points")
        }),
        subtitle: shown.subtitle.clone(),
        synthetic: false, // (the figure of a condition is marked by that)
        description: caption(shown),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels: shown.instants.iter().map(|i| drawing(shown, i)).chain(enlarged).collect(),
    }
}

fn of(label: &str, colour: Colour, mark: Mark, points: Vec<Option<(f64, f64)>>) -> Series {
    Series { label: label.to_owned(), colour, mark, points, ..Series::default() }
}

/// The two links with the tracked points, mm.
fn drawing(shown: &Linkage, instant: &Instant) -> Panel {
    let place = |(x, y): (f64, f64)| Some((1e3 * x, 1e3 * y));
    let moved = |(x, y): (f64, f64), apart: Apart| (x + apart.along_m, y + apart.up_m.unwrap_or_default());
    let [head, hinge, tip] = instant.joints_m;
    let (tracked_head, tracked_tip) = (moved(head, instant.head), moved(tip, instant.tip));
    let said = |name: &str, apart: Apart| {
        let times = decimals(apart.over_noise(shown.noise_m), 1);
        format!("{name} {} ({times} sd)", length(apart.distance_m()))
    };
    // the same length for all instants
    let all = || shown.instants.iter().flat_map(|i| i.joints_m);
    let size = all().map(|(_, y)| y).fold(0.0, f64::max);
    let half = all().map(|(x, _)| x.abs()).fold(0.0, f64::max) + ROOM * size;
    let ellipses = [tracked_head, tracked_tip].map(|at| ellipse(at, shown.noise_m, 1e3));
    // (edged with white, lines and points are seen on any picture)
    let filmed = instant.frame.shown().is_some();
    let look = |plain: Mark| if filmed { Mark::Edged } else { plain };
    let tracked = [place(tracked_head), None, place(tracked_tip)];
    let tracked = tracked.into_iter().filter(|point| filmed || point.is_some()).collect();
    Panel {
        title: format!("{}\n{}, {}", instant.name, said("tip", instant.tip), said("head", instant.head)),
        x: Axis::linear("from the head, mm").between(-1e3 * half, 1e3 * half),
        y: Axis::linear("over the glass, mm").between(-1e3 * ROOM * size, 1e3 * (1.0 + ROOM) * size),
        height_mm: DRAWING_MM,
        series: vec![
            of("glass", Colour::Grey, Mark::Thin, vec![Some((-1e6, 0.0)), Some((1e6, 0.0))]),
            of("neck", Colour::Blue, look(Mark::Thick), vec![place(head), place(hinge)]),
            of("lip", Colour::Orange, look(Mark::Thick), vec![place(hinge), place(tip)]),
            of(TRACKED, Colour::Black, look(Mark::Circles), tracked),
            of("", Colour::Black, Mark::Thin, [ellipses[0].as_slice(), &[None], &ellipses[1]].concat()),
        ],
        equal: true,
        picture: instant.frame.shown().cloned(),
        ..Panel::default()
    }
}

const TRACKED: &str = "tracked head and tip";
/// Looks of the instants where they stand in one panel.
const LOOKS: [(Colour, Shape); SHOWN.len()] = [
    (Colour::Blue, Shape::Disc),
    (Colour::Orange, Shape::Square),
    (Colour::Green, Shape::Diamond),
    (Colour::Purple, Shape::Triangle),
];

/// Tracked minus model of a point at every instant, µm.
fn enlarged(shown: &Linkage, name: &str, point: impl Fn(&Instant) -> Apart) -> Panel {
    // one scale for both points, so that they can be compared
    let all = shown.instants.iter().flat_map(|i| [i.tip, i.head]).map(|a| a.distance_m());
    let most = 1e6 * (all.fold(0.0, f64::max) + ELLIPSE * shown.noise_m[0].max(shown.noise_m[1]));
    let axis = |label: &str| Axis::linear(label).between(-ENLARGED_ROOM * most, ENLARGED_ROOM * most);
    let points = |(instant, (colour, shape)): (&Instant, (Colour, Shape))| {
        let apart = point(instant);
        let (x, y) = (apart.along_m, apart.up_m.unwrap_or_default());
        [
            of("", colour, Mark::Thin, ellipse((x, y), shown.noise_m, 1e6)),
            of(instant.name, colour, Mark::Hollow(shape), vec![Some((1e6 * x, 1e6 * y))]),
        ]
    };
    let model = of("model", Colour::Black, Mark::Crosses, vec![Some((0.0, 0.0))]);
    Panel {
        title: format!("tracked {name} minus model, enlarged"),
        x: axis("along the sweep, \u{b5}m"),
        y: axis("upwards, \u{b5}m"),
        height_mm: DRAWING_MM,
        series: [model].into_iter().chain(shown.instants.iter().zip(LOOKS).flat_map(points)).collect(),
        equal: true,
        ..Panel::default()
    }
}

/// The ellipse of the noise about a point, m, in a unit of figures.
fn ellipse((x, y): (f64, f64), noise_m: [f64; 2], factor: f64) -> Vec<Option<(f64, f64)>> {
    let point = |i: u32| {
        let angle = TAU * f64::from(i) / f64::from(ELLIPSE_POINTS);
        let (dx, dy) = (math::cos(angle) * noise_m[0], math::sin(angle) * noise_m[1]);
        Some((factor * (x + ELLIPSE * dx), factor * (y + ELLIPSE * dy)))
    };
    (0..=ELLIPSE_POINTS).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::{MOST_HEIGHT_MM, Medium};

    fn shown() -> Linkage {
        let instant = |name, along_m, up_m| Instant {
            name,
            time_s: 0.1,
            joints_m: [(0.0, 5e-3), (1e-3, 3e-3), (2.5e-3, 0.0)],
            head: Apart { along_m: 1e-6, up_m: Some(0.0) },
            tip: Apart { along_m, up_m },
            frame: Frame::None,
        };
        Linkage {
            subtitle: "synthetic".to_owned(),
            instants: vec![instant("in the flip", 3e-6, Some(4e-6)), instant("after the flip", 2e-6, None)],
            noise_m: [2e-6, 1e-6],
        }
    }

    #[test]
    fn distances_are_plain_and_in_units_of_the_noise() {
        let tip = shown().instants[0].tip;
        assert!((tip.distance_m() - 5e-6).abs() < 1e-18);
        // 1.5 and 4 standard deviations
        assert!((tip.over_noise([2e-6, 1e-6]) - (9.125_f64).sqrt()).abs() < 1e-12);
        assert!((Apart { along_m: -4e-6, up_m: None }.over_noise([2e-6, 1e-6]) - 2.0).abs() < 1e-12);
        let caption = caption(&shown());
        assert!(
            caption.contains("3.0 times the noise")
                && caption.contains("in the flip, the tip by 5.0 \u{b5}m"),
            "{caption}"
        );
    }

    #[test]
    fn an_ellipse_has_two_standard_deviations_either_way() {
        let points: Vec<(f64, f64)> = ellipse((1e-6, 0.0), [2e-6, 1e-6], 1e6).into_iter().flatten().collect();
        let ends = |of: fn(&(f64, f64)) -> f64| {
            (points.iter().map(of).fold(f64::INFINITY, f64::min), points.iter().map(of).fold(-1e9, f64::max))
        };
        let ((left, right), (low, high)) = (ends(|p| p.0), ends(|p| p.1));
        assert!((left + 3.0).abs() < 1e-9 && (right - 5.0).abs() < 1e-9);
        assert!((low + 2.0).abs() < 1e-9 && (high - 2.0).abs() < 1e-9);
    }

    #[test]
    fn every_instant_has_its_links_and_both_points_are_enlarged() {
        let drawn = figure(&shown());
        assert_eq!((drawn.panels.len(), drawn.columns), (4, 2));
        assert!(drawn.panels.iter().all(|panel| panel.equal));
        assert!(drawn.height_mm(Medium::Column) <= MOST_HEIGHT_MM);
        let svg = drawn.svg(Medium::Page);
        assert!(
            svg.contains("tip 5.0 \u{b5}m (3.0 sd), head 1.0 \u{b5}m (0.4 sd)")
                && svg.contains("synthetic")
                && !svg.contains("NaN")
        );
    }
}
