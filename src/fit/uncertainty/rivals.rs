//! Searches the whole range of every identified parameter for other values that fit equally well (rival
//! values).
//!
//! Slopes and profiles describe the cost near the best point. The cost of a dozen features of one run has
//! many minima: for example, a neck of twice the stiffness may give the same two frequencies. Therefore, for
//! each identified parameter, one search runs below its interval and another above it. Their seeds differ
//! from the seed of the first search.

use super::{FitUncertainty, MAX_RESTARTS, ParameterVerdict, assess_best, polish_within};
use crate::fit::job::IntervalSettings;
use crate::fit::ledger::Ledger;
use crate::fit::linear_model::CHI_SQUARED_95;
use crate::fit::search::{MIN_WORTHWHILE_GAIN, SearchSettings, Slab};
use crate::fit::search::{best_in_slab, search_excluded_region};
use crate::text::format_number;

/// Smallest distance from the best value at which another value counts as a rival, in half widths of the 95 %
/// interval. At this distance a parabolic cost has risen by 15.
const DISTANCE_FACTOR: f64 = 2.0;
/// Rise in cost above which a rival value is excluded: the 99.9 % quantile of chi-squared with one degree of
/// freedom. It is larger than the rise of 3.84 at the ends of a 95 % interval, because a search rarely
/// reaches the exact minimum of another valley of a rough cost.
const MIN_RIVAL_RISE: f64 = 10.8;
/// Width of the narrowest range that is searched, in the unit box; narrower ranges are covered by the
/// profiles.
const MIN_SLAB_WIDTH: f64 = 0.02;
/// A gap splits an interval in two only if the gap is wider than this fraction of the width of the interval.
const MIN_GAP_SHARE: f64 = 0.5;
/// Number of evaluations of all searches for rival values together, as a fraction of the budget of the first
/// search.
const EVALUATION_SHARE: f64 = 0.5;

/// Changes each identified parameter that has a rival value to not identified. If a search finds a better
/// point, that point is polished and assessed instead.
pub(crate) fn confirm_identified(
    ledger: &mut Ledger,
    names: &[String],
    (settings, intervals): (&SearchSettings, &IntervalSettings),
    mut found: FitUncertainty,
) -> FitUncertainty {
    for _ in 0..=MAX_RESTARTS {
        let complete = search_slabs(ledger, &excluded_slabs(&found, ledger, 1.0), settings);
        let gain = found.best.cost - ledger.best_evaluation().map_or(found.best.cost, |best| best.cost);
        if !complete || (gain <= MIN_WORTHWHILE_GAIN && !has_point_outside(&found, ledger)) {
            return withdraw_rivalled(found, ledger, names, complete);
        }
        if gain > MIN_WORTHWHILE_GAIN {
            polish_within(ledger, settings.local_evaluations);
        }
        let Some(again) = assess_best(ledger, names, intervals, settings.local_evaluations) else { break };
        found = again;
    }
    withdraw_rivalled(found, ledger, names, false)
}

/// Whether any evaluated point with a cost within the threshold is outside the interval of an identified
/// parameter.
fn has_point_outside(found: &FitUncertainty, ledger: &Ledger) -> bool {
    let limit = found.best.cost + CHI_SQUARED_95;
    excluded_slabs(found, ledger, 1.0).into_iter().any(|slab| {
        best_in_slab(ledger, slab.shrink_by(MIN_SLAB_WIDTH / 10.0)).is_some_and(|rival| rival.cost <= limit)
    })
}

/// For each identified parameter, two ranges of values: one below and one above the best value. Each range
/// begins at `times` the distance from the best value to the end of the interval on the same side, and
/// extends to the bound.
fn excluded_slabs(found: &FitUncertainty, ledger: &Ledger, times: f64) -> Vec<Slab> {
    let axes = ledger.objective().axes().iter().zip(&found.best.unit).zip(&found.intervals);
    let sides =
        axes.enumerate().filter(|(_, (_, interval))| interval.verdict == ParameterVerdict::Identified);
    let both = sides.flat_map(|(number, ((axis, unit), interval))| {
        let end = |value: Option<f64>| value.map_or(*unit, |value| axis.bounds.unit_coordinate(value));
        let away = |end: f64| unit + times * (end - unit);
        [
            Slab { axis: number, lower: 0.0, upper: away(end(interval.lower_95)) },
            Slab { axis: number, lower: away(end(interval.upper_95)), upper: 1.0 },
        ]
    });
    both.filter(|slab| slab.upper - slab.lower > MIN_SLAB_WIDTH).collect()
}

/// Searches all slabs (ranges of one parameter); returns whether every search was completed.
fn search_slabs(ledger: &mut Ledger, slabs: &[Slab], settings: &SearchSettings) -> bool {
    let budget = EVALUATION_SHARE * (settings.global_evaluations + settings.local_evaluations) as f64;
    let share = (budget / slabs.len().max(1) as f64) as usize;
    slabs.iter().all(|slab| search_excluded_region(ledger, *slab, settings, share).is_none())
}

fn withdraw_rivalled(
    mut found: FitUncertainty,
    ledger: &Ledger,
    names: &[String],
    complete: bool,
) -> FitUncertainty {
    for slab in excluded_slabs(&found, ledger, DISTANCE_FACTOR) {
        let rival = best_in_slab(ledger, slab).filter(|rival| rival.cost <= found.best.cost + MIN_RIVAL_RISE);
        let (Some(rival), Some(name)) = (rival, names.get(slab.axis)) else { continue };
        let Some(interval) = found.intervals.get_mut(slab.axis) else { continue };
        let there = rival.values.get(slab.axis).copied().unwrap_or(f64::NAN);
        let (at, best) = (format_number(there), format_number(interval.estimate));
        interval.withdraw_verdict(format!("another search meets the features about as well at {at}"));
        if rival.cost <= found.best.cost + CHI_SQUARED_95 {
            interval.lower_95 = interval.lower_95.map(|lower| lower.min(there));
            interval.upper_95 = interval.upper_95.map(|upper| upper.max(there));
        }
        found.notes.push(format!(
            "{name} is not called identified: a second search, away from the best point, meets the features \
             about as well at {at} as at {best} (cost {:.1} against {:.1}; {MIN_RIVAL_RISE} more would exclude it); \
             add features that distinguish the two, such as release-after-reversal, mean-deflection or rms",
            rival.cost, found.best.cost
        ));
    }
    for axis in 0..names.len() {
        withdraw_split_interval(&mut found, ledger, names, axis);
    }
    if !complete {
        let why = "the searches for other values as good had not come to their end";
        let identified = found.intervals.iter_mut().filter(|i| i.verdict == ParameterVerdict::Identified);
        if identified.map(|interval| interval.withdraw_verdict(why.to_owned())).count() > 0 {
            found.notes.push(UNCONFIRMED.to_owned());
        }
    }
    found
}

/// Changes an identified parameter to not identified if its interval is split: values with a cost within the
/// threshold lie on both sides of a wide gap in which the profile exceeds the threshold.
fn withdraw_split_interval(found: &mut FitUncertainty, ledger: &Ledger, names: &[String], axis: usize) {
    let (interval, bounds) = (&mut found.intervals[axis], ledger.objective().axes()[axis].bounds);
    let ends = interval.lower_95.zip(interval.upper_95);
    let identified = interval.verdict == ParameterVerdict::Identified;
    let Some((lower, upper)) = ends.filter(|_| identified) else { return };
    let limit = found.best.cost + CHI_SQUARED_95;
    let good = ledger.run_evaluations().iter().filter(|e| e.failure.is_none() && e.cost <= limit);
    let mut places: Vec<f64> = good.filter_map(|e| e.unit.get(axis).copied()).collect();
    places.sort_by(f64::total_cmp);
    let wide = MIN_GAP_SHARE * (bounds.unit_coordinate(upper) - bounds.unit_coordinate(lower));
    let excluded = |from: f64, to: f64| {
        let above = interval.profile.iter().filter(|(_, cost)| *cost > limit);
        above.map(|(value, _)| bounds.unit_coordinate(*value)).any(|u| from < u && u < to)
    };
    let gap = places.windows(2).find(|pair| pair[1] - pair[0] > wide && excluded(pair[0], pair[1]));
    let Some(gap) = gap else { return };
    let [below, above] = [gap[0], gap[1]].map(|u| format_number(bounds.value_at_unit(u)));
    interval.withdraw_verdict(format!(
        "values up to {below} and from {above} on meet the features about as well"
    ));
    found.notes.push(format!(
        "{} is not called identified: values up to {below} and from {above} on meet the features about \
         as well, and none was found between them; add features that distinguish the two",
        names[axis]
    ));
}

const UNCONFIRMED: &str = "nothing is called identified: the searches for other values that are as good had not come to their end, \
    or found better points again and again; raise --max-evaluations, or global_evaluations and local_evaluations in [search], and go on with --resume";
