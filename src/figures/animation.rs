//! Animation of the linkage through a reversal in slow motion: a still figure with moving elements drawn over
//! it, as SVG with SMIL (no script).
//!
//! The still part is a [`Figure`] like any other: a drawing to scale with the poses at a few instants, an
//! enlarged drawing of the tip, and plots of deflection and tip velocity against time. The moving elements
//! are head, neck and lip, the measured points, the name of the contact mode, and a time cursor.

mod drawing;
mod smil;

use super::{Drawing, FigureBlock, FigureText};
use crate::compare::ConditionComparison;
use crate::figures::{NO_TRACES, about, subtitle};
use crate::model::Linkage;
use crate::recording::Recording;
use crate::recording::alignment::Alignment;
use crate::recording::channel::Channel;
use crate::simulate::mode::TipMode;
use crate::simulate::{ModelSample, RunMotion};
use crate::text::format_decimals;
use plain_charts::{ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Series, ShadedSpan};
use portable_math as math;

/// Data of an animation; all times are on one clock.
#[derive(Debug, Clone)]
pub struct Animation {
    /// Subject, such as the title of the job; part of the line under the heading.
    pub title: String,
    /// Whether the measured motion is synthetic.
    pub synthetic: bool,
    /// Whether the shown part contains a reversal of the head.
    pub turns: bool,
    /// The links of the model.
    pub linkage: Linkage,
    /// States of the model in the shown part, close enough together for linear interpolation.
    pub samples: Vec<ModelSample>,
    /// Contact modes of the model, each with the time, s, at which it starts; the first one starts at the
    /// first shown instant.
    pub modes: Vec<(f64, TipMode)>,
    /// Intervals in which the model's tip sticks, s.
    pub stick_s: Vec<[f64; 2]>,
    /// Start and end of the longest stick of the model's tip (the hold), s.
    pub hold_s: [f64; 2],
    /// Measured motion; `None` without a recording.
    pub measured: Option<TrackedMotion>,
    /// The shown parts of the motion and their slow-down factors.
    pub pace: PlaybackPace,
}

/// Measured motion, one value per frame; `None` if a point is not tracked in a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrackedMotion {
    /// Instants of the frames, s.
    pub time_s: Vec<f64>,
    /// Position of the lip tip along the sweep, m.
    pub tip_x_m: Vec<Option<f64>>,
    /// Position of the head along the sweep, m.
    pub head_x_m: Vec<Option<f64>>,
    /// Drop of the head, m.
    pub head_drop_m: Vec<Option<f64>>,
}

/// Style that hides the moving elements from readers who prefer reduced motion; the still poses remain
/// visible.
const LESS_MOTION: &str = "<style>@media (prefers-reduced-motion:reduce){svg .moves{display:none}}</style>\n";

/// The animation as SVG; the same data always give the same bytes. The animation starts with the hold. A
/// print shows this first state together with the drawn poses.
#[must_use]
pub fn render_svg(animation: &Animation) -> String {
    draw_still(animation).svg_with_overlay(|plots| {
        let part = |p: &PlaybackPart| format!("{} {} {}", p.from_s, p.to_s, p.slower);
        let parts: Vec<String> = animation.pace.parts.iter().map(part).collect();
        format!(
            "{LESS_MOTION}<g class=\"moves\" data-pace=\"{}\" data-duration=\"{}\">\n{}</g>\n",
            parts.join(";"),
            animation.pace.duration_s(),
            smil::moving_elements(animation, plots)
        )
    })
}

impl Animation {
    /// Name of the shown part, for captions.
    pub(crate) fn part_name(&self) -> &'static str {
        if self.turns { "the reversal" } else { "its longest stick" }
    }

    /// The main result in one sentence, with its number.
    fn claim_sentence(&self) -> String {
        let rest_ms = 1e3 * (self.hold_s[1] - self.hold_s[0]);
        let when = if self.turns { " while the head turns" } else { "" };
        format!("The tip of the model rests for {} ms{when}", format_decimals(rest_ms, 1))
    }
}

/// The part of the figure that does not move.
fn draw_still(animation: &Animation) -> Figure {
    let source = if animation.measured.is_none() { NO_TRACES } else { "" };
    let note = about(source, &describe_pace(&animation.pace));
    let drawing = drawing::draw_linkage_panel(animation);
    let enlarged = drawing::draw_tip_panel(animation, drawing.height_mm);
    Figure {
        title: animation.claim_sentence(),
        subtitle: about(&animation.title, &subtitle(animation.synthetic, &note)),
        watermarked: animation.synthetic,
        description: format!(
            "Animation of the linkage of head, neck and lip through {}, with deflection and velocity of the \
             tip over time.",
            if animation.turns { "the reversal of the head" } else { animation.part_name() }
        ),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels: [vec![drawing, enlarged], draw_strips(animation)].concat(),
    }
}

/// The slow-down factors as text: "100 times slower than the motion, then 500 times".
pub(crate) fn describe_pace(pace: &PlaybackPace) -> String {
    let factors: Vec<String> = pace.parts.iter().map(|p| format!("{} times", p.slower)).collect();
    let [first, rest @ ..] = factors.as_slice() else { return String::new() };
    let rest: String = rest.iter().map(|f| format!(", then {f}")).collect();
    format!("{first} slower than the motion{rest}")
}

// The animation of a condition: the model's reversal in fine steps, and the measured motion on the same
// clock.

/// Maximum number of states of an animation. A reversal with its release takes about 0.1 s, so each cycle of
/// a 1 kHz oscillation then has 25 states.
const MOST_SAMPLES: usize = 2500;

/// The animation of a condition; `None` if the model's tip never sticks.
pub(crate) fn figure_block(case: &ConditionComparison) -> Option<FigureBlock> {
    let shown = build_animation(case)?;
    let drawing = Drawing::Moving(render_svg(&shown));
    Some(case.model_figure_block("animation", figure_text(&shown), drawing))
}

fn build_animation(case: &ConditionComparison) -> Option<Animation> {
    let (motion, shift) = (&case.model.motion, case.alignment.shift_s);
    let hold = motion.longest_stick_s()?;
    let run = [motion.samples.first()?.time_s, motion.samples.last()?.time_s];
    let pace = PlaybackPace::around_hold(hold, run)?;
    let span = pace.span_s();
    let interval = |[from, to]: [f64; 2]| [from + shift, to + shift];
    let stick = motion.stick_s.iter().filter(|[from, to]| *to > span[0] && *from < span[1]);
    Some(Animation {
        title: case.figure_title(),
        synthetic: case.is_synthetic(),
        turns: motion.turn_s().is_some_and(|turn_s| turn_s >= span[0] && turn_s <= span[1]),
        linkage: motion.linkage,
        samples: thin_samples(motion, span, shift),
        modes: contact_modes(motion, span).into_iter().map(|(since, mode)| (since + shift, mode)).collect(),
        stick_s: stick.map(|s| interval(*s)).collect(),
        hold_s: interval(hold),
        measured: case.recording().map(|r| tracked_motion(r, &case.alignment, span.map(|t| t + shift))),
        pace: pace.shift_by(shift),
    })
}

/// At most [`MOST_SAMPLES`] states of a time interval (plus its last state), with their times shifted by
/// `shift_s`.
fn thin_samples(motion: &RunMotion, span_s: [f64; 2], shift_s: f64) -> Vec<ModelSample> {
    let fine = motion.fine_samples_between(span_s);
    let every = fine.len().div_ceil(MOST_SAMPLES).max(1);
    let last = fine.last().filter(|_| !(fine.len() - 1).is_multiple_of(every));
    let chosen = fine.iter().step_by(every).chain(last);
    chosen.map(|s| ModelSample { time_s: s.time_s + shift_s, ..*s }).collect()
}

/// The frames in a time interval and the nearest frame on either side of it, in the coordinates of the model.
fn tracked_motion(recording: &Recording, alignment: &Alignment, [from_s, to_s]: [f64; 2]) -> TrackedMotion {
    let grid = recording.grid();
    let place = |t: f64| ((t - grid.start_s) * grid.frame_rate_hz).clamp(0.0, grid.frames as f64);
    let frames = (place(from_s).floor() as usize)..(place(to_s).ceil() as usize + 1).min(grid.frames);
    let of = |channel: Channel, origin_m: f64| {
        let samples = channel.samples(recording);
        samples.get(frames.clone()).unwrap_or_default().iter().map(|x| x.map(|x| x - origin_m)).collect()
    };
    TrackedMotion {
        time_s: frames.clone().map(|i| grid.time_s(i)).collect(),
        tip_x_m: of(Channel::TipX, alignment.offset_m(Channel::TipX)),
        head_x_m: of(Channel::HeadX, alignment.along_m),
        head_drop_m: of(Channel::HeadDrop, alignment.drop_m),
    }
}

/// The contact modes in a time interval, each with the time, s, at which it starts; the first starts with the
/// interval.
fn contact_modes(motion: &RunMotion, [from_s, to_s]: [f64; 2]) -> Vec<(f64, TipMode)> {
    let first = motion.samples.iter().rfind(|s| s.time_s <= from_s).map(|s| (from_s, s.mode));
    let inside = motion.transitions.iter().filter(|t| t.time_s > from_s && t.time_s <= to_s);
    first.into_iter().chain(inside.map(|t| (t.time_s, t.to))).collect()
}

/// Caption with the numbers of the hold.
fn figure_text(shown: &Animation) -> FigureText {
    let [from_s, to_s] = shown.hold_s;
    let at = |time_s: f64| shown.samples.iter().rfind(|s| s.time_s <= time_s).or(shown.samples.first());
    let held = at(from_s).zip(at(to_s)).map(|(from, to)| {
        let (stick_ms, way_m) = (1e3 * (to_s - from_s), to.head_x_m - from.head_x_m);
        format!(
            ": the tip sticks for {stick_ms:.1} ms while its head moves by {} mm",
            format_decimals(1e3 * way_m, 2)
        )
    });
    let caption = format!(
        "The fitted model in motion through {}, {}{}.",
        shown.part_name(),
        describe_pace(&shown.pace),
        held.unwrap_or_default()
    );
    FigureText { caption, details: String::new() }
}

// Playback pace: parts of the motion, each with its slow-down factor.

/// A part of the motion with one slow-down factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaybackPart {
    /// Start of the part, on the clock of the motion, s.
    pub from_s: f64,
    /// End of the part, on the clock of the motion, s.
    pub to_s: f64,
    /// Slow-down factor: playback time divided by the duration of the motion.
    pub slower: f64,
}

impl PlaybackPart {
    /// Makes a part whose slow-down factor is a round number, such that its playback takes about `wanted_s`.
    fn with_duration(from_s: f64, to_s: f64, wanted_s: f64) -> Self {
        Self { from_s, to_s, slower: round_to_125(wanted_s / (to_s - from_s)).max(1.0) }
    }
}

/// Pace of the playback: consecutive parts without gaps. After the last part, the final picture stays for a
/// second.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlaybackPace {
    /// The parts, in order of time.
    pub parts: Vec<PlaybackPart>,
}

/// Time, s, for which the final picture stays before the animation starts again.
const REST_S: f64 = 1.0;
/// Playback time of the hold and its lead-in, s.
const HOLD_SHOWN_S: f64 = 7.0;
/// Playback time of the release and the motion after it, s.
const RELEASE_SHOWN_S: f64 = 10.0;
/// Duration of the motion shown before the hold, divided by the duration of the hold.
const LEAD_IN: f64 = 0.06;
/// Duration of the last part of the hold, which is shown with the slower pace of the release, divided by the
/// duration of the hold.
const RELEASE_LEAD: f64 = 0.02;
/// Duration of the motion shown after the hold, divided by the duration of the hold.
const FOLLOW_UP: f64 = 0.3;

impl PlaybackPace {
    /// Two parts: the hold of the tip, and the release of the tip with some cycles after it. The second part
    /// is slowed down more. Both parts are limited to the interval `within`; `None` if both are outside that
    /// interval.
    #[must_use]
    pub fn around_hold([hold_s, release_s]: [f64; 2], within: [f64; 2]) -> Option<Self> {
        let length = release_s - hold_s;
        let instants =
            [hold_s - LEAD_IN * length, release_s - RELEASE_LEAD * length, release_s + FOLLOW_UP * length]
                .map(|t| t.max(within[0]).min(within[1]));
        let pairs = instants.windows(2).zip([HOLD_SHOWN_S, RELEASE_SHOWN_S]);
        let moving = pairs.filter(|(pair, _)| pair[0] < pair[1]);
        let parts: Vec<PlaybackPart> =
            moving.map(|(pair, s)| PlaybackPart::with_duration(pair[0], pair[1], s)).collect();
        (!parts.is_empty()).then_some(Self { parts })
    }

    /// Start and end of the shown motion, s.
    #[must_use]
    pub fn span_s(&self) -> [f64; 2] {
        [self.parts.first().map_or(0.0, |p| p.from_s), self.parts.last().map_or(1.0, |p| p.to_s)]
    }

    /// Start and end of the last part, s.
    pub(crate) fn last_part_s(&self) -> [f64; 2] {
        self.parts.last().map_or(self.span_s(), |p| [p.from_s, p.to_s])
    }

    /// The same playback pace with all instants shifted by `shift_s`.
    pub(crate) fn shift_by(self, shift_s: f64) -> Self {
        let later =
            |p: PlaybackPart| PlaybackPart { from_s: p.from_s + shift_s, to_s: p.to_s + shift_s, ..p };
        Self { parts: self.parts.into_iter().map(later).collect() }
    }

    /// Playback time, including that of the final picture, s.
    pub(crate) fn duration_s(&self) -> f64 {
        self.parts.iter().map(|p| (p.to_s - p.from_s) * p.slower).sum::<f64>() + REST_S
    }

    /// Playback time at which an instant of the motion is shown, as a fraction of the total playback time.
    pub(crate) fn playback_fraction(&self, time_s: f64) -> f64 {
        let shown_s: f64 =
            self.parts.iter().map(|p| (time_s.clamp(p.from_s, p.to_s) - p.from_s) * p.slower).sum();
        shown_s / self.duration_s()
    }
}

/// The number of the form 1, 2 or 5 times a power of ten that is nearest to `value` on a logarithmic scale.
pub(super) fn round_to_125(value: f64) -> f64 {
    let power = math::powf(10.0, math::log10(value).floor());
    let apart = |candidate: &f64| math::ln(candidate / value).abs();
    let nearest =
        [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
    nearest.unwrap_or(value)
}

// Strip charts under the drawings: the deflection in the whole shown motion, and the tip velocity in the last
// part of that motion.

const HEIGHT_MM: f64 = 27.0;
const MM: f64 = 1e3;

/// A quantity of the model plotted against time.
struct StripChart {
    label: &'static str,
    /// Legend entry and line style of the model's curve.
    line: (&'static str, Mark),
    of: fn(&ModelSample) -> f64,
    /// Start and end of the time axis, s.
    span_s: fn(&PlaybackPace) -> [f64; 2],
}

const STRIPS: [StripChart; 2] = [
    StripChart {
        label: "deflection, mm",
        line: ("model", Mark::Thick),
        of: |s| MM * (s.tip_x_m - s.head_x_m),
        span_s: PlaybackPace::span_s,
    },
    StripChart {
        label: "tip velocity, m/s",
        line: ("", Mark::Line),
        of: |s| s.tip_velocity_m_per_s,
        span_s: PlaybackPace::last_part_s,
    },
];

/// The strip charts; the first one also shows the measured deflection.
pub(super) fn draw_strips(animation: &Animation) -> Vec<Panel> {
    let mut panels: Vec<Panel> = STRIPS.iter().map(|strip| draw_strip(animation, strip)).collect();
    if let (Some(first), Some(measured)) = (panels.first_mut(), &animation.measured) {
        let deflection =
            measured.tip_x_m.iter().zip(&measured.head_x_m).map(|(tip, head)| Some((*tip)? - (*head)?));
        let points = measured.time_s.iter().zip(deflection).map(|(t, x)| x.map(|x| (*t, MM * x)));
        first.series.push(Series::new("measured", Colour::Black, Mark::Thin, points));
    }
    panels
}

/// Start and end of the time axis of each strip, s.
pub(super) fn strip_spans_s(animation: &Animation) -> [[f64; 2]; 2] {
    STRIPS.map(|strip| (strip.span_s)(&animation.pace))
}

fn draw_strip(animation: &Animation, strip: &StripChart) -> Panel {
    let [from_s, to_s] = (strip.span_s)(&animation.pace);
    let whole = [from_s, to_s] == animation.pace.span_s();
    let points = animation.samples.iter().map(|s| (s.time_s, (strip.of)(s)));
    let stick = |[from, to]: &[f64; 2]| ShadedSpan::new("tip sticks (model)", Colour::SkyBlue, *from, *to);
    let slower = animation.pace.parts.iter().skip(1).filter(|_| whole).map(|p| {
        ShadedSpan::outline(format!("shown {} times slower", p.slower), Colour::Grey, p.from_s, p.to_s)
    });
    let (x, y) = (ChartAxis::time().with_range(from_s, to_s), ChartAxis::linear(strip.label));
    let series = Series::new(strip.line.0, Colour::Vermilion, strip.line.1, points);
    Panel {
        shaded_spans: animation.stick_s.iter().map(stick).chain(slower).collect(),
        ..Panel::new(x, y, HEIGHT_MM, [series])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_round() {
        assert_eq!(
            [0.7, 1.2, 1.6, 3.0, 4.0, 98.0, 640.0].map(round_to_125),
            [0.5, 1.0, 2.0, 2.0, 5.0, 100.0, 500.0]
        );
    }

    #[test]
    fn the_release_is_slower_than_the_hold_and_both_last_about_as_long_as_wanted() {
        let pace = PlaybackPace::around_hold([0.666, 0.732], [0.56, 1.15]).unwrap();
        assert_eq!(pace.parts.iter().map(|p| p.slower).collect::<Vec<_>>(), [100.0, 500.0]);
        assert!((12.0..=20.0).contains(&pace.duration_s()), "{}", pace.duration_s());
        assert_eq!(pace.parts[0].to_s, pace.parts[1].from_s);
    }

    #[test]
    fn shares_follow_the_parts_and_leave_a_rest() {
        let part = |from_s, to_s, slower| PlaybackPart { from_s, to_s, slower };
        let pace = PlaybackPace { parts: vec![part(1.0, 1.02, 100.0), part(1.02, 1.03, 500.0)] };
        assert!((pace.duration_s() - 8.0).abs() < 1e-9); // 2 s, 5 s, and 1 s for the final picture
        for (time_s, expected) in [
            (0.5, 0.0),
            (1.01, 1.0 / 8.0),
            (1.02, 2.0 / 8.0),
            (1.025, 4.5 / 8.0),
            (1.03, 7.0 / 8.0),
            (9.0, 7.0 / 8.0),
        ] {
            assert!((pace.playback_fraction(time_s) - expected).abs() < 1e-9, "{time_s}");
        }
    }

    #[test]
    fn a_run_that_ends_early_is_shown_as_far_as_it_goes() {
        let pace = PlaybackPace::around_hold([0.666, 0.732], [0.56, 0.70]).unwrap();
        assert_eq!((pace.parts.len(), pace.span_s()[1]), (1, 0.70));
        assert_eq!(PlaybackPace::around_hold([0.666, 0.732], [0.9, 0.9]), None);
        assert_eq!(PlaybackPace::around_hold([0.7, f64::NAN], [f64::NAN, f64::NAN]), None);
    }
}
