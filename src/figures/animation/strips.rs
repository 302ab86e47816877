//! Deflection over all that is shown and velocity of the tip over the last part, under the drawings.

use super::Animation;
use super::pace::PlaybackPace;
use crate::chart::{ChartAxis, Colour, Mark, Panel, Series, ShadedSpan};
use crate::simulate::ModelSample;

const HEIGHT_MM: f64 = 27.0;
const MM: f64 = 1e3;

/// A quantity of the model's states over time.
struct StripChart {
    label: &'static str,
    /// What the model's line is called in the legend, and how it is drawn.
    line: (&'static str, Mark),
    of: fn(&ModelSample) -> f64,
    /// The instants that it covers, s.
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

/// The panels; the first one holds the measured deflection too.
pub(super) fn draw_strips(animation: &Animation) -> Vec<Panel> {
    let mut panels: Vec<Panel> = STRIPS.iter().map(|strip| draw_strip(animation, strip)).collect();
    if let (Some(first), Some(measured)) = (panels.first_mut(), &animation.measured) {
        let deflection =
            measured.tip_x_m.iter().zip(&measured.head_x_m).map(|(tip, head)| Some((*tip)? - (*head)?));
        let points = measured.time_s.iter().zip(deflection).map(|(t, x)| x.map(|x| (*t, MM * x))).collect();
        first.series.push(Series {
            label: "measured".to_owned(),
            mark: Mark::Thin,
            points,
            ..Series::default()
        });
    }
    panels
}

/// The instants that every strip covers, s.
pub(super) fn strip_spans_s(animation: &Animation) -> [[f64; 2]; 2] {
    STRIPS.map(|strip| (strip.span_s)(&animation.pace))
}

fn draw_strip(animation: &Animation, strip: &StripChart) -> Panel {
    let [from_s, to_s] = (strip.span_s)(&animation.pace);
    let whole = [from_s, to_s] == animation.pace.span_s();
    let points = animation.samples.iter().map(|s| Some((s.time_s, (strip.of)(s)))).collect();
    let stick = |[from, to]: &[f64; 2]| ShadedSpan {
        label: "tip sticks (model)".to_owned(),
        colour: Colour::SkyBlue,
        from: *from,
        to: *to,
        ..ShadedSpan::default()
    };
    let slower = animation.pace.parts.iter().skip(1).filter(|_| whole).map(|p| ShadedSpan {
        label: format!("shown {} times slower", p.slower),
        colour: Colour::Grey,
        from: p.from_s,
        to: p.to_s,
        outlined: true,
    });
    Panel {
        x: ChartAxis::time().with_range(from_s, to_s),
        y: ChartAxis::linear(strip.label),
        height_mm: HEIGHT_MM,
        series: vec![Series {
            label: strip.line.0.to_owned(),
            colour: Colour::Vermilion,
            mark: strip.line.1,
            points,
            ..Series::default()
        }],
        shaded_spans: animation.stick_s.iter().map(stick).chain(slower).collect(),
        ..Panel::default()
    }
}
