//! Evidence for a fit: recording and model against time, with the residual in units of the noise; the whole
//! recording, and enlarged parts at the release and at the worst misfit.

use super::history::{length_unit, symmetric_axis, thin_points};
use super::{FigureBlock, FigureText, history};
use crate::compare::ConditionComparison;
use crate::compare::summary::describe_drift;
use crate::figures::full_figure;
use crate::recording::channel::{Channel, InstantKind};
use crate::recording::motion_traces::MotionTraces;
use crate::simulate::ModelSample;
use crate::text::{capitalise, format_digits, format_length, format_trimmed};
use plain_charts::{ChartAxis, Colour, Figure, Mark, Panel, Ribbon, SampledSeries, Series, ShadedSpan};

/// Times, s, and values; `None` interrupts the curve.
pub(crate) type TimeCurve = Vec<Option<(f64, f64)>>;

/// A part of the recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EvidencePart {
    /// Name, such as "release".
    pub name: String,
    /// Start and end, s.
    pub span_s: (f64, f64),
    /// Measured values, m.
    pub measured: TimeCurve,
    /// Values of the model, m.
    pub model: TimeCurve,
    /// Measured minus model, in standard deviations of the noise.
    pub residual: TimeCurve,
    /// Root mean square of `residual`.
    pub rms: f64,
    /// Shaded spans in which the model's tip sticks.
    pub sticks: Vec<ShadedSpan>,
    /// Further text after the heading of the part; empty for none.
    pub remark: String,
}

/// Data of the figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EvidencePlot {
    /// Heading: the main result with its number.
    pub title: String,
    /// Further text for the line under the heading; empty for none.
    pub note: String,
    /// Whether the recording is synthetic.
    pub synthetic: bool,
    /// Quantity, such as "deflection".
    pub quantity: String,
    /// The whole recording, then the enlarged parts.
    pub parts: Vec<EvidencePart>,
}

/// Name of the part with one run of the model over the whole recording.
const SINGLE_RUN: &str = "one run";
/// Largest ratio of the root mean square of a residual to that of the noise at which the residual still
/// counts as noise. It exceeds 1 since the noise is known only to a few per cent.
pub(crate) const NOTHING_LEFT: f64 = 1.1;
/// Height, mm, of a panel with recording and model.
const HEIGHT_MM: f64 = 30.0;
/// Height, mm, of a panel with the residual.
const RESIDUAL_HEIGHT_MM: f64 = 15.0;
/// Half width of the interval that contains 95 % of the noise, in standard deviations.
const NOISE_95: f64 = 1.96;

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &EvidencePlot) -> Figure {
    let panels = shown.parts.iter().enumerate().flat_map(|(i, part)| draw_panels(shown, i, part));
    full_figure(
        &shown.title,
        shown.synthetic,
        &shown.note,
        format!(
            "{} measured and of the model over time, with what lies between them in units of the noise: {}.",
            capitalise(&shown.quantity),
            shown.parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>().join(", ")
        ),
        panels,
    )
}

fn draw_panels(shown: &EvidencePlot, index: usize, part: &EvidencePart) -> Vec<Panel> {
    let values = || part.model.iter().chain(&part.measured).flatten().map(|(_, x)| *x);
    let (unit, factor) = length_unit(values());
    let (single_run, (from, to)) = (part.name == SINGLE_RUN, part.span_s);
    let whole = index == 0 || single_run;
    let series = |label: &str, colour, mark, course: &TimeCurve, factor: f64| {
        let scaled: TimeCurve = course.iter().map(|p| p.map(|(t, x)| (t, x * factor))).collect();
        Series::new(label, colour, mark, thin_points(&scaled, part.span_s))
    };
    // frames are drawn as dots in an enlarged part, and as a line in the panel of the whole recording
    let (frames, measured) =
        if whole { (Mark::Thin, "measured") } else { (Mark::Dots, "measured, frame by frame") };
    let details = |of: &[(&TimeCurve, f64)]| {
        let all = of.iter().map(|(course, factor)| sample_curve(course, *factor));
        if whole { all.collect() } else { Vec::new() }
    };
    let enlarged = |part: &EvidencePart| {
        ShadedSpan::outline("enlarged below", Colour::Black, part.span_s.0, part.span_s.1)
    };
    let enlarged: Vec<ShadedSpan> =
        shown.parts.iter().skip(1).filter(|part| whole && part.name != SINGLE_RUN).map(enlarged).collect();
    let time = ChartAxis::time().with_range(from, to);
    let quantity = ChartAxis::linear(format!("{}, {unit}", shown.quantity));
    let curves = [
        series("model", Colour::Vermilion, Mark::Line, &part.model, factor),
        series(measured, Colour::Black, frames, &part.measured, factor),
    ];
    let title = format!("{}: {} times the noise{}", part.name, format_digits(part.rms, 2), part.remark);
    let upper = Panel {
        title: title.clone(),
        sampled_series: details(&[(&part.model, factor), (&part.measured, factor)]),
        shaded_spans: if whole { enlarged.clone() } else { part.sticks.clone() },
        ..Panel::new(time.clone(), quantity, HEIGHT_MM, curves)
    };
    let points = thin_points(&part.residual, part.span_s);
    let all: TimeCurve = points.into_iter().chain([Some((0.0, NOISE_95))]).collect();
    let label = if whole { "measured \u{2212} model" } else { "" };
    let residual = series(label, Colour::Green, frames, &part.residual, 1.0);
    let noise = [from, to].map(|t| (t, -NOISE_95, NOISE_95));
    let y = symmetric_axis(ChartAxis::linear("residual / noise"), &all);
    let lower = Panel {
        title: if single_run { title } else { String::new() },
        sampled_series: details(&[(&part.residual, 1.0)]),
        shaded_spans: enlarged,
        ribbons: vec![Ribbon::new("95 % of the noise", Colour::SkyBlue, noise)],
        ..Panel::new(time, y, RESIDUAL_HEIGHT_MM, [residual])
    };
    // over the whole recording, the two curves of a single run look the same, so only their difference is
    // drawn
    if single_run { vec![lower] } else { vec![upper, lower] }
}

/// A page contains all frames of a curve if there are at most this many; longer curves would exceed the size
/// limit of a page, 1 MB.
const MOST_FRAMES: usize = 15_000;

/// All frames of a curve; `None` for fewer than two known values or more than [`MOST_FRAMES`] frames.
fn sample_curve(course: &TimeCurve, factor: f64) -> Option<SampledSeries> {
    let known = || course.iter().enumerate().filter_map(|(i, p)| p.map(|(t, _)| (i, t)));
    let ((i, from), (j, to)) = (known().next()?, known().next_back()?);
    let step = (to - from) / (j - i) as f64;
    let values = course.iter().map(|p| p.map(|(_, x)| x * factor)).collect();
    (j > i && course.len() <= MOST_FRAMES).then_some(SampledSeries {
        start: from - i as f64 * step,
        step,
        values,
    })
}

// Evidence for a condition: whole recording, release, and worst part after the release.

/// The enlarged part begins by the first time, s, before the release and ends by the second time, s, after
/// it.
const AROUND_RELEASE_S: (f64, f64) = (0.005, 0.03);
/// Length of the part with the worst misfit, s: a dozen cycles of the high component.
const LATE_S: f64 = 0.015;
/// Minimum fraction of the frames in which a part must have a value to be chosen as the worst part. The mean
/// square of few values scatters more, and could be the largest by chance.
const LEAST_PRESENT: f64 = 0.5;

/// The figure of a condition; `None` without a recording, or if recording and model move in opposite
/// directions.
pub(crate) fn figure_block(case: &ConditionComparison) -> Option<FigureBlock> {
    let residual = case.judged_residual()?;
    let (channel, noise_m) = case.judged_channel()?;
    let measured = case.measured_motion.as_ref()?;
    let restarted = case.restarted_motion.as_ref();
    let single = MotionTraces::from_model(&case.model.view.recording, &case.alignment);
    let frame_s = 1.0 / case.measured_or_model().recording.grid().frame_rate_hz;
    let whole_s = (*residual.time_s.first()?, *residual.time_s.last()?);
    let drift = case.drift_cycles().map(|cycles| format!(", {}", describe_drift(cycles)));
    let part = |name: String, span_s: (f64, f64)| {
        let is_single = restarted.is_none() || name == SINGLE_RUN;
        let (residual, model) = match restarted {
            Some(model) if !is_single => (residual, model),
            _ => (case.residual.as_ref()?, &single),
        };
        let rms = residual.rms_m(channel, Some(span_s))? / noise_m;
        let fine = Some(span_s).filter(|span_s| is_single && *span_s != whole_s);
        let fine = fine.and_then(|span_s| model_states_curve(case, channel, span_s));
        let left = channel_between(residual, channel, span_s).into_iter();
        Some(EvidencePart {
            name,
            span_s,
            measured: channel_between(measured, channel, span_s),
            model: fine.unwrap_or_else(|| channel_between(model, channel, span_s)),
            residual: left.map(|p| p.map(|(t, x)| (t, x / noise_m))).collect(),
            rms,
            sticks: history::stick_spans(&case.sticks_on_clock(), span_s, frame_s),
            remark: drift.clone().filter(|_| restarted.is_some() && is_single).unwrap_or_default(),
        })
    };
    let release_s = case.measured_or_model().instant_s(InstantKind::Release);
    let around = |t: f64| ((t - AROUND_RELEASE_S.0).max(whole_s.0), (t + AROUND_RELEASE_S.1).min(whole_s.1));
    let around_s = release_s.map(around).filter(|(from, to)| from < to);
    let later_s = (around_s.map_or(whole_s.0, |(_, to)| to), whole_s.1);
    let worst_s = worst_s(residual, channel, later_s).filter(|(from, to)| from < to);
    let later = if around_s.is_some() { "worst later" } else { "worst part" };
    let single_s = restarted.is_some().then_some(whole_s);
    let spans =
        [("recording", Some(whole_s)), ("release", around_s), (later, worst_s), (SINGLE_RUN, single_s)];
    let parts: Vec<EvidencePart> =
        spans.into_iter().filter_map(|(name, span_s)| part(name.to_owned(), span_s?)).collect();
    let whole = parts.first()?.rms;
    let shown = EvidencePlot {
        title: figure_title(case, channel, whole, noise_m),
        note: restart_clause(case).unwrap_or_default(),
        synthetic: case.is_synthetic(),
        quantity: channel.label(),
        parts,
    };
    Some(case.figure_block("evidence", figure_text(&shown), draw_figure(&shown)))
}

/// Start and end, s, of the part of length [`LATE_S`] within a time interval whose residual has the largest
/// mean square. An interval shorter than [`LATE_S`] is returned whole; `None` if the interval contains no
/// value.
fn worst_s(residual: &MotionTraces, channel: Channel, (from_s, to_s): (f64, f64)) -> Option<(f64, f64)> {
    let first = residual.time_s.partition_point(|t| *t < from_s);
    let end = residual.time_s.partition_point(|t| *t <= to_s);
    let times = residual.time_s.get(first..end)?;
    let column = residual.column(channel).get(first..end)?;
    let (start_s, last_s) = (*times.first()?, *times.last()?);
    column.iter().flatten().next()?;
    let frames = (LATE_S / (last_s - start_s) * (times.len() - 1) as f64).round() as usize + 1;
    if frames >= times.len() || frames < 2 {
        return Some((start_s, last_s));
    }
    // cumulative sum of squares and number of values before each frame
    let mut sums = vec![(0.0, 0usize)];
    for value in column {
        let (square, count) = sums.last().copied().unwrap_or_default();
        sums.push(value.map_or((square, count), |x| (square + x * x, count + 1)));
    }
    let mean = |at: usize| {
        let ((before, counted), (after, all)) = (sums[at], sums[at + frames]);
        let count = all - counted;
        let enough = count as f64 >= LEAST_PRESENT * frames as f64;
        enough.then(|| (at, (after - before) / count as f64))
    };
    let worst = (0..=times.len() - frames).filter_map(mean).reduce(|a, b| if b.1 > a.1 { b } else { a });
    worst.map_or(Some((start_s, last_s)), |(at, _)| Some((times[at], times[at + frames - 1])))
}

/// Values of a channel between two instants.
fn channel_between(motion: &MotionTraces, channel: Channel, (from_s, to_s): (f64, f64)) -> TimeCurve {
    let all = motion.time_s.iter().zip(motion.column(channel));
    all.filter(|(t, _)| **t >= from_s && **t <= to_s).map(|(t, x)| x.map(|x| (*t, x))).collect()
}

/// A curve through the model's own states, which are denser than the frames. `None` for the head drop, or if
/// the frames of the recording are at least as dense as the states.
fn model_states_curve(
    case: &ConditionComparison,
    channel: Channel,
    (from_s, to_s): (f64, f64),
) -> Option<TimeCurve> {
    let (shift_s, by_m) = (case.alignment.shift_s, case.alignment.along_m);
    let samples = case.model.motion.fine_samples_between([from_s - shift_s, to_s - shift_s]);
    let frames = (to_s - from_s) * case.model.view.recording.grid().frame_rate_hz;
    let place = |s: &ModelSample| match channel {
        Channel::Deflection => Some(s.tip_x_m - s.head_x_m),
        Channel::TipX => Some(s.tip_x_m + by_m),
        Channel::HeadX => Some(s.head_x_m + by_m),
        Channel::HeadDrop => None,
    };
    let point = |s: &ModelSample| place(s).map(|x| Some((s.time_s + shift_s, x)));
    samples.iter().map(point).collect::<Option<TimeCurve>>().filter(|_| samples.len() as f64 > frames)
}

/// The main result in one sentence, with its number.
fn figure_title(case: &ConditionComparison, channel: Channel, rms: f64, noise_m: f64) -> String {
    let (label, left, noise) = (channel.label(), format_length(rms * noise_m), format_length(noise_m));
    let model = if case.restarted.is_some() { "The model" } else { "One run of the model" };
    let is_verdict = case.result.status.has_ended() && case.result.explains_recordings();
    if rms <= NOTHING_LEFT && case.restarted.is_some() && !is_verdict {
        return format!("What the model leaves of the {label} is no more than its noise of {noise}");
    }
    if rms <= NOTHING_LEFT {
        return format!("{model} explains the {label} to within its noise of {noise}");
    }
    format!("{model} misses the {label} by {left}, {} times the noise", format_digits(rms, 2))
}

/// Caption: the claim, with the parts in units of the noise and the drift of the single run.
fn figure_text(shown: &EvidencePlot) -> FigureText {
    let ratio = |part: &EvidencePart| {
        let digits = format_digits(part.rms, 2);
        match part.name.as_str() {
            SINGLE_RUN => format!("{digits} in one run{}", part.remark),
            "worst later" | "worst part" => format!("{digits} where it fits worst"),
            "release" => format!("{digits} at the release of the tip"),
            _ => format!("{digits} over the recording"),
        }
    };
    let parts: Vec<String> = shown.parts.iter().map(ratio).collect();
    let caption = format!("{}: residual over noise {}.", shown.title, parts.join(", "));
    FigureText { caption, details: String::new() }
}

/// Clause on the segments of a fit to traces, at whose starts the model restarts; `None` for other fits.
fn restart_clause(case: &ConditionComparison) -> Option<String> {
    case.restarted.as_ref()?;
    let longest = case.result.misfit.as_ref()?.stages.last()?;
    Some(format!("restarted every {} ms", format_trimmed(1e3 * longest.segment_s, 3)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example_evidence() -> EvidencePlot {
        let course =
            |scale: f64| (0..100).map(|i| Some((f64::from(i) * 0.01, scale * f64::from(i % 7)))).collect();
        let part = |name: &str, span_s| EvidencePart {
            name: name.to_owned(),
            span_s,
            measured: course(1e-5),
            model: course(1e-5),
            residual: course(1.0),
            rms: 3.46,
            sticks: Vec::new(),
            remark: String::new(),
        };
        EvidencePlot {
            title: "t".to_owned(),
            quantity: "deflection".to_owned(),
            synthetic: true,
            parts: vec![part("whole recording", (0.0, 1.0)), part("release", (0.2, 0.3))],
            ..EvidencePlot::default()
        }
    }

    #[test]
    fn every_part_has_its_number_and_what_is_enlarged_is_framed() {
        let drawn = draw_figure(&example_evidence());
        assert_eq!(drawn.panels.len(), 4);
        assert_eq!(drawn.panels[2].title, "release: 3.5 times the noise");
        assert_eq!((drawn.panels[0].shaded_spans[0].from, drawn.panels[0].shaded_spans[0].to), (0.2, 0.3));
        assert!(drawn.panels[0].shaded_spans[0].outlined && drawn.panels[3].shaded_spans.is_empty());
    }

    #[test]
    fn the_axis_of_a_residual_holds_all_of_it_and_the_noise() {
        let drawn = draw_figure(&example_evidence());
        let (low, high) = drawn.panels[1].y.range.unwrap();
        assert!(low < -6.0 && high > 6.0);
        let mut quiet = example_evidence();
        quiet.parts[0].residual = vec![Some((0.5, 0.1))];
        assert!(draw_figure(&quiet).panels[1].y.range.unwrap().1 > NOISE_95);
    }

    fn residual(of: impl Fn(usize) -> Option<f64>) -> MotionTraces {
        MotionTraces {
            time_s: (0..1000).map(|i| i as f64 * 1e-3).collect(),
            tip_x_m: (0..1000).map(of).collect(),
            head_x_m: vec![None; 1000],
            deflection_m: vec![None; 1000],
            head_drop_m: vec![None; 1000],
        }
    }

    #[test]
    fn the_worst_part_is_where_the_residual_is_largest() {
        let found = residual(|i| Some(if (400..416).contains(&i) { 5.0 } else { 1.0 }));
        let frames = |first: usize, last: usize| Some((found.time_s[first], found.time_s[last]));
        assert_eq!(worst_s(&found, Channel::TipX, (0.0, 1.0)), frames(400, 415));
        assert_eq!(worst_s(&found, Channel::TipX, (0.5, 0.6)), frames(500, 515));
        assert_eq!(worst_s(&found, Channel::TipX, (0.5, 0.51)), frames(500, 510));
        assert_eq!(worst_s(&found, Channel::HeadX, (0.0, 1.0)), None);
    }

    #[test]
    fn a_single_frame_among_lost_ones_is_not_the_worst_part() {
        let gap = |i: usize| (100..200).contains(&i);
        let found = residual(|i| match i {
            150 => Some(9.0),
            600..616 => Some(2.0),
            _ => Some(1.0).filter(|_| !gap(i)),
        });
        assert_eq!(worst_s(&found, Channel::TipX, (0.0, 1.0)), Some((found.time_s[600], found.time_s[615])));
    }
}
