//! The evidence of a fit: measured and model on one axis of time, what lies between them in units of the
//! noise, and the same enlarged at the release and where it fits worst.

pub(crate) mod caption;

use super::history::{length_unit, symmetric_axis, thin_points};
use crate::chart::{
    ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Ribbon, SampledSeries, Series, ShadedSpan,
};
use crate::figures::subtitle;

/// A course over time, `None` where it is interrupted: times, s, and values.
pub type TimeCurve = Vec<Option<(f64, f64)>>;

/// A part of the recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EvidencePart {
    /// What it shows, such as "release".
    pub name: String,
    /// From when to when, s.
    pub span_s: (f64, f64),
    /// Measured values, m.
    pub measured: TimeCurve,
    /// Values of the model, m.
    pub model: TimeCurve,
    /// Measured minus model, in standard deviations of the noise.
    pub residual: TimeCurve,
    /// Its root mean square.
    pub rms: f64,
    /// Where the model's tip sticks, as bands.
    pub sticks: Vec<ShadedSpan>,
}

/// What the figure shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EvidencePlot {
    /// Heading: the claim with its number.
    pub title: String,
    /// More to say; empty for none.
    pub note: String,
    /// Whether the recording is one that no camera took.
    pub synthetic: bool,
    /// Quantity, such as "deflection".
    pub quantity: String,
    /// The whole recording first, then what is enlarged.
    pub parts: Vec<EvidencePart>,
}

/// Residual over noise up to which nothing but noise is left: of its size a few per cent are not known.
pub(crate) const NOTHING_LEFT: f64 = 1.1;
/// Heights of the panels, mm.
const HEIGHT_MM: f64 = 30.0;
const RESIDUAL_HEIGHT_MM: f64 = 15.0;
/// Deviations within which 95 % of the noise lies.
const NOISE_95: f64 = 1.96;
const RESIDUAL_LABEL: &str = "measured \u{2212} model";

/// The figure.
#[must_use]
pub fn draw_figure(shown: &EvidencePlot) -> Figure {
    let panels = shown.parts.iter().enumerate().flat_map(|(i, part)| draw_panels(shown, i, part));
    Figure {
        title: shown.title.clone(),
        subtitle: subtitle(shown.synthetic, &shown.note),
        watermarked: shown.synthetic,
        description: format!(
            "{} measured and of the model over time, with what lies between them in units of the noise: {}.",
            crate::text::capitalise(&shown.quantity),
            shown.parts.iter().map(|part| part.name.as_str()).collect::<Vec<_>>().join(", ")
        ),
        width_mm: FULL_WIDTH_MM,
        panels: panels.collect(),
        ..Figure::default()
    }
}

fn draw_panels(shown: &EvidencePlot, index: usize, part: &EvidencePart) -> [Panel; 2] {
    let values = || part.model.iter().chain(&part.measured).flatten().map(|(_, x)| *x);
    let (unit, factor) = length_unit(values());
    let whole = index == 0;
    let series = |label: &str, colour, mark, (course, factor): (&TimeCurve, f64)| Series {
        label: label.to_owned(),
        colour,
        mark,
        points: thin_points(&scale_curve(course, factor), part.span_s),
        ..Series::default()
    };
    // (frames that stand apart are points; all of them together are a line)
    let (frames, measured) =
        if whole { (Mark::Thin, "measured") } else { (Mark::Dots, "measured, frame by frame") };
    let details = |of: &[(&TimeCurve, f64)]| {
        let all = of.iter().map(|(course, factor)| sample_curve(course, *factor));
        if whole { all.collect() } else { Vec::new() }
    };
    let time = ChartAxis::time().with_range(part.span_s.0, part.span_s.1);
    let upper = Panel {
        title: format!("{}: {} times the noise", part.name, format_noise_ratio(part.rms)),
        x: time.clone(),
        y: ChartAxis::linear(format!("{}, {unit}", shown.quantity)),
        height_mm: HEIGHT_MM,
        series: vec![
            series("model", Colour::Vermilion, Mark::Line, (&part.model, factor)),
            series(measured, Colour::Black, frames, (&part.measured, factor)),
        ],
        sampled_series: details(&[(&part.model, factor), (&part.measured, factor)]),
        shaded_spans: if whole { enlarged_part_spans(shown) } else { part.sticks.clone() },
        ..Panel::default()
    };
    let points = thin_points(&part.residual, part.span_s);
    let noise = [Some((0.0, NOISE_95))];
    let all: TimeCurve = points.iter().copied().chain(noise).collect();
    let (from, to) = part.span_s;
    let lower = Panel {
        x: time,
        y: symmetric_axis(ChartAxis::linear("residual / noise"), &all),
        height_mm: RESIDUAL_HEIGHT_MM,
        series: vec![series(
            if whole { RESIDUAL_LABEL } else { "" },
            Colour::Green,
            frames,
            (&part.residual, 1.0),
        )],
        sampled_series: details(&[(&part.residual, 1.0)]),
        shaded_spans: if whole { enlarged_part_spans(shown) } else { Vec::new() },
        ribbons: vec![Ribbon {
            label: "95 % of the noise".to_owned(),
            colour: Colour::SkyBlue,
            points: [from, to].map(|t| Some((t, -NOISE_95, NOISE_95))).to_vec(),
        }],
        ..Panel::default()
    };
    [upper, lower]
}

/// Most frames of a course that a page carries in full: longer ones would fill its megabyte.
const MOST_FRAMES: usize = 15_000;

/// Every frame of a course, which has one entry a frame; `None` for fewer than two known ones, or too many.
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

/// The parts that are enlarged, framed.
fn enlarged_part_spans(shown: &EvidencePlot) -> Vec<ShadedSpan> {
    let band = |part: &EvidencePart| ShadedSpan {
        label: "enlarged below".to_owned(),
        colour: Colour::Black,
        from: part.span_s.0,
        to: part.span_s.1,
        outlined: true,
    };
    shown.parts.iter().skip(1).map(band).collect()
}

fn scale_curve(course: &TimeCurve, factor: f64) -> TimeCurve {
    course.iter().map(|p| p.map(|(t, x)| (t, x * factor))).collect()
}

/// A ratio to the noise in words.
fn format_noise_ratio(rms: f64) -> String {
    crate::text::format_digits(rms, 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown() -> EvidencePlot {
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
        let drawn = draw_figure(&shown());
        assert_eq!(drawn.panels.len(), 4);
        assert_eq!(drawn.panels[2].title, "release: 3.5 times the noise");
        assert_eq!((drawn.panels[0].shaded_spans[0].from, drawn.panels[0].shaded_spans[0].to), (0.2, 0.3));
        assert!(drawn.panels[0].shaded_spans[0].outlined && drawn.panels[3].shaded_spans.is_empty());
    }

    #[test]
    fn the_axis_of_a_residual_holds_all_of_it_and_the_noise() {
        let drawn = draw_figure(&shown());
        let (low, high) = drawn.panels[1].y.range.unwrap();
        assert!(low < -6.0 && high > 6.0);
        let mut quiet = shown();
        quiet.parts[0].residual = vec![Some((0.5, 0.1))];
        assert!(draw_figure(&quiet).panels[1].y.range.unwrap().1 > NOISE_95);
    }
}
