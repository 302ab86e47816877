//! Exchanged points, exchanged columns and a flipped y axis, recognised by the motion: the head is driven
//! smoothly and sinks when the blade leans; the tip sticks and slips, and keeps its height on the glass.

use super::finding::{Check, QualityFinding, Severity};
use super::measurement::{ChannelQuality, Quality};
use super::motion::{head_height_m, trimmed_range_m};
use super::outliers::smallest_movement;
use super::regression::{fit_rows, polynomial_row};
use crate::recording::Traces;
use crate::recording::channel::ReversalInstants;

/// Number of blocks into which a stroke is divided. In each block, a cubic is fitted to the path along the
/// sweep.
const BLOCKS: usize = 8;
/// Minimum number of frames of a block.
const LEAST_BLOCK: usize = 16;
/// Smallest ratio of the roughnesses of two paths at which the rougher path is taken for that of the tip. The
/// roughness is the mean square deviation from cubics, in units of the squared noise. The smoother path
/// counts as at least 1, the roughness of noise.
const ROUGHER: f64 = 3.0;
/// Smallest difference of the travels of two points around a turn that shows which one is the head, as a
/// fraction of the travel. The head travels farther, because the tip rests while the head passes over it.
const FARTHER: f64 = 0.05;
/// Range of the middle 98 % of white noise, in standard deviations.
const NOISE_RANGE: f64 = 4.65;
/// Smallest ratio of the range of a height to that of noise at which the height varies. The other height must
/// have a range that is smaller than that of the varying height by at least the same factor.
const VARIES: f64 = 1.6;
/// Smallest difference between the heights of two points, or between their travels, that counts, in units of
/// the noise.
const HEIGHT_NOISES: f64 = 10.0;
/// Smallest height of the upper point above the lower one that counts, in units of the range of the
/// deflection: a blade that leans to both sides by 45 degrees has a range of 1.4 times its height.
const HEIGHT_DEFLECTIONS: f64 = 0.3;
/// Smallest range of a point along y that shows exchanged columns, as a fraction of its range along x. With
/// correct columns the fraction is smaller: the head sinks by at most a third of the height of the blade, and
/// its travel in a film is at least this height.
const ALONG_Y: f64 = 0.8;
/// Smallest range of a point along y that shows exchanged columns, in units of the noise or the step along y,
/// whichever is larger.
const ALONG_Y_NOISES: f64 = 30.0;
/// Maximum number of frames in the fit of a point's height against its position along the sweep.
const MOST_ROWS: usize = 4_000;

/// Mean square of the deviation of a path from the cubics of its blocks, in units of the squared noise.
fn roughness(samples: &[Option<f64>], noise_m: f64, strokes: usize) -> Option<f64> {
    let length = (samples.len() / (BLOCKS * strokes)).max(LEAST_BLOCK);
    let block = |block: &[Option<f64>]| {
        let row =
            |(i, x): (usize, &Option<f64>)| Some((polynomial_row::<4>(i as f64 / length as f64), (*x)?));
        let start = block.iter().flatten().next()?;
        let rows: Vec<_> = block.iter().enumerate().filter_map(row).map(|(p, x)| (p, x - start)).collect();
        Some(fit_rows(&rows)?.mean_square)
    };
    let squares: Vec<f64> = samples.chunks(length).filter_map(block).collect();
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    (noise_m > 0.0 && !squares.is_empty()).then(|| mean / (noise_m * noise_m))
}

/// Range of a height, in units of the range of noise, after tilt and curvature of the glass are removed (a
/// parabola along the sweep).
fn height_range(x: &[Option<f64>], y: &[Option<f64>], quality: &ChannelQuality) -> Option<f64> {
    /// Range, m, of a height that never changes, but was interpolated.
    const ROUNDING_M: f64 = 1e-12;
    let step_m = quality.step_m.or_else(|| smallest_movement(y));
    if trimmed_range_m(y)? <= ROUNDING_M {
        return Some(0.0);
    }
    let noise_m = quality.noise_m?.max(step_m.unwrap_or(0.0) / 3.0);
    let centre = x.iter().flatten().next()?;
    let reach = trimmed_range_m(x)?.max(f64::MIN_POSITIVE);
    let some = x.iter().zip(y).step_by(x.len() / MOST_ROWS + 1);
    let rows: Vec<_> =
        some.filter_map(|(x, y)| Some((polynomial_row::<3>(((*x)? - centre) / reach), (*y)?))).collect();
    let fit = fit_rows(&rows)?;
    let level = |p: &[f64; 3]| p.iter().zip(&fit.coefficients).map(|(p, c)| p * c).sum::<f64>();
    let rest: Vec<Option<f64>> = rows.iter().map(|(p, y)| Some(y - level(p))).collect();
    Some(trimmed_range_m(&rest)? / (NOISE_RANGE * noise_m))
}

/// Finding on exchanged points, on exchanged columns, or on a wrong direction of y.
pub(super) fn check_columns(
    traces: &Traces,
    measured: &Quality,
    instants: &ReversalInstants,
) -> Option<QualityFinding> {
    if let Some(found) = check_sweep_along_y(traces, measured) {
        return Some(found);
    }
    let strokes = instants.reversals.len() + 1;
    let (tip, head) = ((&traces.tip_x_m, &traces.tip_y_m), (&traces.head_x_m, &traces.head_y_m));
    let noise_of = |tip: &ChannelQuality, head: &ChannelQuality| {
        let sizes = [tip.noise_m, tip.step_m, head.noise_m, head.step_m];
        sizes.into_iter().flatten().fold(0.0, f64::max)
    };
    let noise_x_m = noise_of(&measured.tip_x, &measured.head_x);
    let farther_m = trimmed_range_m(tip.0)? - trimmed_range_m(head.0)?;
    let least_farther_m = (HEIGHT_NOISES * noise_x_m).max(FARTHER * trimmed_range_m(head.0)?);
    let farther = farther_m.abs() > least_farther_m && strokes > 1;
    let rough = [tip.0, head.0].map(|x| roughness(x, noise_x_m, strokes));
    let x_exchanged = match rough {
        [Some(tip), Some(head)] if head > ROUGHER * tip.max(1.0) => Some(true),
        [Some(tip), Some(head)] if tip > ROUGHER * head.max(1.0) => Some(false),
        _ => farther.then_some(farther_m > 0.0),
    };
    let varies = [(tip, &measured.tip_y), (head, &measured.head_y)].map(|((x, y), q)| height_range(x, y, q));
    let y_exchanged = match varies {
        [Some(tip), Some(head)] if tip > VARIES && head < tip / VARIES => Some(true),
        [Some(tip), Some(head)] if head > VARIES && tip < head / VARIES => Some(false),
        _ => None,
    };
    let height_m = head_height_m(traces)?;
    let noise_m = noise_of(&measured.tip_y, &measured.head_y);
    let deflection: Vec<_> = tip.0.iter().zip(head.0).map(|(tip, head)| Some((*tip)? - (*head)?)).collect();
    let least_m =
        (HEIGHT_NOISES * noise_m).max(HEIGHT_DEFLECTIONS * trimmed_range_m(&deflection).unwrap_or(0.0));
    let upside_down = -height_m > least_m;
    let facts = [
        (upside_down, format!("the tip lies {:.3} mm above the head", -1e3 * height_m)),
        (x_exchanged == Some(true), "the tip moves as a head does, smoothly and farther".to_owned()),
        (y_exchanged == Some(true), "the head keeps its height and the tip does not".to_owned()),
    ];
    // (if x gives no answer, y decides; if y gives none, x and the order of the heights decide)
    let y_exchanged = y_exchanged.unwrap_or(upside_down && x_exchanged == Some(true));
    let x_exchanged = x_exchanged.unwrap_or(y_exchanged);
    let flipped = upside_down != y_exchanged;
    let (check, advice) = match (x_exchanged, y_exchanged) {
        (true, true) => (Check::SwappedPoints, "tip and head seem exchanged: check --point and --columns"),
        (true, false) => (Check::MixedColumns, "x of tip and head seem exchanged: check --columns"),
        (false, true) => (Check::MixedColumns, "y of tip and head seem exchanged: check --columns"),
        (false, false) if flipped => (
            Check::YDirection,
            "a blade stands on its lip: check --y-axis (image coordinates point down), and which point is \
             the tip; no matter if the camera stood on its head",
        ),
        (false, false) => return None,
    };
    let facts = facts.into_iter().filter_map(|(holds, fact)| holds.then_some(fact));
    let found = facts.collect::<Vec<_>>().join("; ");
    let advice = if flipped && check != Check::YDirection {
        format!("{advice}, and --y-axis")
    } else {
        advice.to_owned()
    };
    let value = (-height_m, "m");
    Some(QualityFinding::advise((check, Severity::Caution), value, found, advice))
}

/// Finding on a point whose range along y is nearly as large as its range along x, or larger.
fn check_sweep_along_y(traces: &Traces, measured: &Quality) -> Option<QualityFinding> {
    let points = [
        ("tip", &traces.tip_x_m, &traces.tip_y_m, &measured.tip_y),
        ("head", &traces.head_x_m, &traces.head_y_m, &measured.head_y),
    ];
    points.into_iter().find_map(|(name, x, y, quality)| {
        let (along_x, along_y) = (trimmed_range_m(x)?, trimmed_range_m(y)?);
        let clear = along_y > ALONG_Y_NOISES * quality.noise_m?.max(quality.step_m.unwrap_or(0.0));
        let found = format!(
            "the {name} moves by {:.3} mm along y and {:.3} mm along x",
            1e3 * along_y,
            1e3 * along_x
        );
        let advice = "the blade sweeps along x: check --columns, x and y or two points seem exchanged";
        let kind = (Check::MixedColumns, Severity::Caution);
        (clear && along_y > ALONG_Y * along_x)
            .then(|| QualityFinding::advise(kind, (along_y, "m"), found, advice))
    })
}
