//! Long lines in few points.

use crate::recording::motion_traces::MOTION_CHANNELS;
use crate::recording::motion_traces::MotionTraces;

/// Parts of a span that a line is thinned to: a printed part is a third of a millimetre over a page, and no
/// wider than the line.
const THINNING_PARTS: usize = 400;

/// Lowest and highest point of each of [`THINNING_PARTS`] parts of a span, in order; lines of no more than two points
/// a part are left as they are. A gap narrower than a part is none, wider ones stay.
pub(crate) fn thin_points(points: &[Option<(f64, f64)>], (from, to): (f64, f64)) -> Vec<Option<(f64, f64)>> {
    if points.len() <= 2 * THINNING_PARTS || from >= to {
        return points.to_vec();
    }
    let part = |t: f64| ((t - from) / (to - from) * THINNING_PARTS as f64).floor();
    let present: Vec<(f64, f64)> =
        points.iter().flatten().copied().filter(|(t, x)| t.is_finite() && x.is_finite()).collect();
    let mut kept = Vec::with_capacity(3 * THINNING_PARTS);
    let mut before = None;
    for group in present.chunk_by(|a, b| part(a.0) == part(b.0)) {
        let here = part(group[0].0);
        if before.is_some_and(|before| here > before + 1.0) {
            kept.push(None);
        }
        before = Some(here);
        let lowest = group.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
        let highest = group.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
        let mut ends: Vec<(f64, f64)> = [lowest, highest].into_iter().flatten().collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        ends.dedup();
        kept.extend(ends.into_iter().map(Some));
    }
    kept
}

/// Frames up to which a motion is light.
const MAX_FULL_FRAMES: usize = 20_000;

/// The frames of a long motion that figures of a span and of a part of it show: all of that part, and of each
/// of [`THINNING_PARTS`] parts of the span those in which a column is lowest or highest. Three motions of a million
/// frames would take more memory than all else that a report needs.
pub(super) fn thin_frames(
    motion: MotionTraces,
    (from, to): (f64, f64),
    enlarged_s: Option<(f64, f64)>,
) -> MotionTraces {
    let times = &motion.time_s;
    let Some(last) = times.len().checked_sub(1).filter(|_| times.len() > MAX_FULL_FRAMES && from < to) else {
        return motion;
    };
    let inside = |t: f64| enlarged_s.is_some_and(|(from, to)| t >= from && t <= to);
    let mut kept: Vec<bool> =
        times.iter().enumerate().map(|(i, t)| i == 0 || i == last || inside(*t)).collect();
    let part = |i: &usize| ((times[*i] - from) / (to - from) * THINNING_PARTS as f64).floor();
    for channel in MOTION_CHANNELS {
        let column = motion.column(channel);
        let present: Vec<usize> =
            (0..=last).filter(|i| times[*i] >= from && times[*i] <= to && column[*i].is_some()).collect();
        for group in present.chunk_by(|a, b| part(a) == part(b)) {
            let value = |i: &&usize| column[**i].unwrap_or_default();
            let ends = [
                group.iter().min_by(|a, b| value(a).total_cmp(&value(b))),
                group.iter().max_by(|a, b| value(a).total_cmp(&value(b))),
            ];
            ends.into_iter().flatten().for_each(|i| kept[*i] = true);
        }
    }
    let of = |column: &[Option<f64>]| {
        column.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(x, _)| *x).collect()
    };
    MotionTraces {
        time_s: times.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(t, _)| *t).collect(),
        tip_x_m: of(&motion.tip_x_m),
        head_x_m: of(&motion.head_x_m),
        deflection_m: of(&motion.deflection_m),
        head_drop_m: of(&motion.head_drop_m),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_and_wide_gaps_stay() {
        // a spike in part 100 and a hole of ten parts behind it
        let spike = |i: usize| if i == 2505 { 9.0 } else { 0.0 };
        let points: Vec<_> = (0..10_000)
            .map(|i| (!(3000..3250).contains(&i) && i % 7 != 3).then(|| (i as f64, spike(i))))
            .collect();
        let kept = thin_points(&points, (0.0, 10_000.0));
        assert!(kept.len() <= 3 * THINNING_PARTS && kept.contains(&Some((2505.0, 9.0))));
        assert_eq!(kept.iter().filter(|p| p.is_none()).count(), 1);
    }

    #[test]
    fn a_lighter_motion_is_drawn_alike() {
        let frames = 100_000;
        let column = |scale: f64| {
            (0..frames)
                .map(|i| (i % 7 != 3).then(|| scale * (i as f64 * 0.37).sin() * (i as f64 * 1e-4).cos()))
                .collect::<Vec<_>>()
        };
        let time_s: Vec<f64> = (0..frames).map(f64::from).collect();
        let whole = MotionTraces {
            time_s,
            tip_x_m: column(1.0),
            head_x_m: column(2.0),
            deflection_m: column(3.0),
            head_drop_m: column(4.0),
        };
        let (span, part) = ((10.0, 90_000.0), (40_000.0, 40_500.0));
        let light = thin_frames(whole.clone(), span, Some(part));
        assert!(
            light.time_s.len() < 6000 && light.time_s.last() == whole.time_s.last(),
            "{}",
            light.time_s.len()
        );
        for channel in MOTION_CHANNELS {
            let drawn = |motion: &MotionTraces, (from, to): (f64, f64)| {
                let inside = motion
                    .time_s
                    .iter()
                    .zip(motion.column(channel))
                    .filter(|(t, _)| **t >= from && **t <= to);
                thin_points(&inside.map(|(t, x)| x.map(|x| (*t, x))).collect::<Vec<_>>(), (from, to))
            };
            assert_eq!(drawn(&light, span), drawn(&whole, span), "{channel}");
            assert_eq!(drawn(&light, part), drawn(&whole, part), "{channel}");
        }
    }

    #[test]
    fn short_lines_are_left_as_they_are() {
        let points = [Some((0.0, 1.0)), None, Some((2.0, f64::NAN))];
        assert_eq!(thin_points(&points, (0.0, 1.0))[..2], points[..2]);
    }
}
