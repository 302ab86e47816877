//! Whether other values of a parameter that is about to be called identified are as good, looked for over its
//! whole range.
//!
//! Slopes and profiles say what is known near the best point. A dozen features of one run make a cost with
//! many minima, and two frequencies may be met as well by a neck twice as stiff. So each parameter has to
//! stand a search of its own below its interval and another above it, with other seeds than the first search.

use super::{FitUncertainty, MAX_RESTARTS, ParameterVerdict, assess_best};
use crate::fit::job::IntervalSettings;
use crate::fit::ledger::Ledger;
use crate::fit::linear_model::CHI_SQUARED_95;
use crate::fit::search::SearchSettings;
use crate::fit::search::{MIN_WORTHWHILE_GAIN, Slab, best_in_slab, polish_best, search_excluded_region};
use crate::text::format_number;

/// A value this many times as far from the best one as the interval reaches is another one. Where the cost is
/// a parabola it has risen by 15 there.
const DISTANCE_FACTOR: f64 = 2.0;
/// Rise in cost, so far away, below which other values are not excluded. Chi-squared of one degree of freedom
/// that one in a thousand exceeds: 10.8. It is more than the 3.84 of an interval, because a search rarely
/// comes to the very minimum of another valley of a rough cost.
const MIN_RIVAL_RISE: f64 = 10.8;
/// A range narrower than this, in the unit box, is not searched: profiles have come so near.
const MIN_SLAB_WIDTH: f64 = 0.02;
/// Share of an interval from which on a gap in it makes it two.
const MIN_GAP_SHARE: f64 = 0.5;
/// Evaluations of all these searches together, as a share of those of the search itself.
const EVALUATION_SHARE: f64 = 0.5;

/// What was found, where nothing stays identified that a search elsewhere contradicts. A better point that is
/// met on the way is polished and assessed instead.
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
            let limit = ledger.evaluation_limit();
            ledger.set_limit(
                limit.min(ledger.run_evaluations().len().saturating_add(settings.local_evaluations)),
            );
            polish_best(ledger);
            ledger.set_limit(limit);
        }
        let Some(again) = assess_best(ledger, names, intervals, settings.local_evaluations) else { break };
        found = again;
    }
    withdraw_rivalled(found, ledger, names, false)
}

/// Whether a point as good as the best lies outside the interval of an identified parameter.
fn has_point_outside(found: &FitUncertainty, ledger: &Ledger) -> bool {
    let limit = found.best.cost + CHI_SQUARED_95;
    excluded_slabs(found, ledger, 1.0).into_iter().any(|slab| {
        best_in_slab(ledger, slab.shrink_by(MIN_SLAB_WIDTH / 10.0)).is_some_and(|rival| rival.cost <= limit)
    })
}

/// The ranges below and above each identified parameter, from so many times as far as its interval reaches.
fn excluded_slabs(found: &FitUncertainty, ledger: &Ledger, times: f64) -> Vec<Slab> {
    let axes = ledger.objective().axes().iter().zip(&found.best.unit).zip(&found.intervals);
    let sides =
        axes.enumerate().filter(|(_, (_, interval))| interval.verdict == ParameterVerdict::Identified);
    let both = sides.flat_map(|(number, ((axis, unit), interval))| {
        let end = |value: Option<f64>| value.map_or(*unit, |value| axis.bounds.to_unit(value));
        let away = |end: f64| unit + times * (end - unit);
        [
            Slab { axis: number, lower: 0.0, upper: away(end(interval.lower_95)) },
            Slab { axis: number, lower: away(end(interval.upper_95)), upper: 1.0 },
        ]
    });
    both.filter(|slab| slab.upper - slab.lower > MIN_SLAB_WIDTH).collect()
}

/// Whether every slab was searched.
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
        interval.withdraw_verdict(format!(
            "another search meets the features about as well at {}",
            format_number(there)
        ));
        if rival.cost <= found.best.cost + CHI_SQUARED_95 {
            interval.lower_95 = interval.lower_95.map(|lower| lower.min(there));
            interval.upper_95 = interval.upper_95.map(|upper| upper.max(there));
        }
        found.notes.push(format!(
            "{name} is not called identified: a second search, away from the best point, meets the features \
             about as well at {} as at {} (cost {:.1} against {:.1}; {MIN_RIVAL_RISE} more would exclude it); \
             add features that distinguish the two, such as release-after-reversal, mean-deflection or rms",
            format_number(there),
            format_number(interval.estimate),
            rival.cost,
            found.best.cost
        ));
    }
    for axis in 0..names.len() {
        withdraw_split_interval(&mut found, ledger, names, axis);
    }
    if !complete && found.intervals.iter().any(|i| i.verdict == ParameterVerdict::Identified) {
        for interval in found.intervals.iter_mut().filter(|i| i.verdict == ParameterVerdict::Identified) {
            interval.withdraw_verdict(
                "the searches for other values as good had not come to their end".to_owned(),
            );
        }
        found.notes.push(UNCONFIRMED.to_owned());
    }
    found
}

/// Bars a parameter whose interval is two: values as good as the best on both sides of a wide gap in which
/// the profile has found none.
fn withdraw_split_interval(found: &mut FitUncertainty, ledger: &Ledger, names: &[String], axis: usize) {
    let (Some(interval), Some(bounds)) =
        (found.intervals.get_mut(axis), ledger.objective().axes().get(axis).map(|a| a.bounds))
    else {
        return;
    };
    let (Some(lower), Some(upper), ParameterVerdict::Identified) =
        (interval.lower_95, interval.upper_95, interval.verdict)
    else {
        return;
    };
    let limit = found.best.cost + CHI_SQUARED_95;
    let good = ledger.run_evaluations().iter().filter(|e| e.failure.is_none() && e.cost <= limit);
    let mut places: Vec<f64> = good.filter_map(|e| e.unit.get(axis).copied()).collect();
    places.sort_by(f64::total_cmp);
    let wide = MIN_GAP_SHARE * (bounds.to_unit(upper) - bounds.to_unit(lower));
    let excluded = |from: f64, to: f64| {
        let above = interval.profile.iter().filter(|(_, cost)| *cost > limit);
        above.map(|(value, _)| bounds.to_unit(*value)).any(|u| from < u && u < to)
    };
    let gap = places.windows(2).find(|pair| pair[1] - pair[0] > wide && excluded(pair[0], pair[1]));
    let Some([below, above]) = gap.map(|pair| [pair[0], pair[1]].map(|u| bounds.from_unit(u))) else {
        return;
    };
    let [below, above] = [below, above].map(format_number);
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
