//! Whether other values of a parameter that is about to be called identified are as good, looked for over its
//! whole range.
//!
//! Slopes and profiles say what is known near the best point. A dozen features of one run make a cost with
//! many minima, and two frequencies may be met as well by a neck twice as stiff. So each parameter has to
//! stand a search of its own below its interval and another above it, with other seeds than the first search.

use super::{RESTARTS, Uncertainty, Verdict, at_best};
use crate::fit::information::CHI_SQUARED_95;
use crate::fit::job::IntervalSettings;
use crate::fit::ledger::Ledger;
use crate::fit::search::{Slab, WORTH, best_in, elsewhere, polish};
use crate::fit::settings::Settings;
use crate::text::number;

/// A value this many times as far from the best one as the interval reaches is another one. Where the cost is
/// a parabola it has risen by 15 there.
const AWAY: f64 = 2.0;
/// Rise in cost, so far away, below which other values are not excluded. Chi-squared of one degree of freedom
/// that one in a thousand exceeds: 10.8. It is more than the 3.84 of an interval, because a search rarely
/// comes to the very minimum of another valley of a rough cost.
const RIVAL: f64 = 10.8;
/// A range narrower than this, in the unit box, is not searched: profiles have come so near.
const NARROWEST: f64 = 0.02;
/// Share of an interval from which on a gap in it makes it two.
const GAP: f64 = 0.5;
/// Evaluations of all these searches together, as a share of those of the search itself.
const SHARE: f64 = 0.5;

/// What was found, where nothing stays identified that a search elsewhere contradicts. A better point that is
/// met on the way is polished and assessed instead.
#[must_use]
pub(crate) fn confirmed(
    ledger: &mut Ledger,
    names: &[String],
    (settings, intervals): (&Settings, &IntervalSettings),
    mut found: Uncertainty,
) -> Uncertainty {
    for _ in 0..=RESTARTS {
        let complete = searched(ledger, &slabs(&found, ledger, 1.0), settings);
        let gain = found.best.cost - ledger.best().map_or(found.best.cost, |best| best.cost);
        if !complete || (gain <= WORTH && !reaches_farther(&found, ledger)) {
            return judged(found, ledger, names, complete);
        }
        if gain > WORTH {
            let limit = ledger.limit();
            ledger.set_limit(limit.min(ledger.run().len().saturating_add(settings.local_evaluations)));
            polish(ledger);
            ledger.set_limit(limit);
        }
        let Some(again) = at_best(ledger, names, intervals, settings.local_evaluations) else { break };
        found = again;
    }
    judged(found, ledger, names, false)
}

/// Whether a point as good as the best lies outside the interval of an identified parameter.
fn reaches_farther(found: &Uncertainty, ledger: &Ledger) -> bool {
    let limit = found.best.cost + CHI_SQUARED_95;
    slabs(found, ledger, 1.0).into_iter().any(|slab| {
        best_in(ledger, slab.without_edge(NARROWEST / 10.0)).is_some_and(|rival| rival.cost <= limit)
    })
}

/// The ranges below and above each identified parameter, from so many times as far as its interval reaches.
fn slabs(found: &Uncertainty, ledger: &Ledger, times: f64) -> Vec<Slab> {
    let axes = ledger.objective().axes().iter().zip(&found.best.unit).zip(&found.intervals);
    let sides = axes.enumerate().filter(|(_, (_, interval))| interval.verdict == Verdict::Identified);
    let both = sides.flat_map(|(number, ((axis, unit), interval))| {
        let end = |value: Option<f64>| value.map_or(*unit, |value| axis.bounds.to_unit(value));
        let away = |end: f64| unit + times * (end - unit);
        [
            Slab { axis: number, lower: 0.0, upper: away(end(interval.lower_95)) },
            Slab { axis: number, lower: away(end(interval.upper_95)), upper: 1.0 },
        ]
    });
    both.filter(|slab| slab.upper - slab.lower > NARROWEST).collect()
}

/// Whether every slab was searched.
fn searched(ledger: &mut Ledger, slabs: &[Slab], settings: &Settings) -> bool {
    let budget = SHARE * (settings.global_evaluations + settings.local_evaluations) as f64;
    let share = (budget / slabs.len().max(1) as f64) as usize;
    slabs.iter().all(|slab| elsewhere(ledger, *slab, settings, share).is_none())
}

fn judged(mut found: Uncertainty, ledger: &Ledger, names: &[String], complete: bool) -> Uncertainty {
    for slab in slabs(&found, ledger, AWAY) {
        let rival = best_in(ledger, slab).filter(|rival| rival.cost <= found.best.cost + RIVAL);
        let (Some(rival), Some(name)) = (rival, names.get(slab.axis)) else { continue };
        let Some(interval) = found.intervals.get_mut(slab.axis) else { continue };
        let there = rival.values.get(slab.axis).copied().unwrap_or(f64::NAN);
        interval.bar(format!("another search meets the features about as well at {}", number(there)));
        if rival.cost <= found.best.cost + CHI_SQUARED_95 {
            interval.lower_95 = interval.lower_95.map(|lower| lower.min(there));
            interval.upper_95 = interval.upper_95.map(|upper| upper.max(there));
        }
        found.notes.push(format!(
            "{name} is not called identified: a second search, away from the best point, meets the features \
             about as well at {} as at {} (cost {:.1} against {:.1}; {RIVAL} more would exclude it); \
             add features that distinguish the two, such as release-after-reversal, mean-deflection or rms",
            number(there),
            number(interval.estimate),
            rival.cost,
            found.best.cost
        ));
    }
    for axis in 0..names.len() {
        island(&mut found, ledger, names, axis);
    }
    if !complete && found.intervals.iter().any(|i| i.verdict == Verdict::Identified) {
        for interval in found.intervals.iter_mut().filter(|i| i.verdict == Verdict::Identified) {
            interval.bar("the searches for other values as good had not come to their end".to_owned());
        }
        found.notes.push(UNCONFIRMED.to_owned());
    }
    found
}

/// Bars a parameter whose interval is two: values as good as the best on both sides of a wide gap in which
/// the profile has found none.
fn island(found: &mut Uncertainty, ledger: &Ledger, names: &[String], axis: usize) {
    let (Some(interval), Some(bounds)) =
        (found.intervals.get_mut(axis), ledger.objective().axes().get(axis).map(|a| a.bounds))
    else {
        return;
    };
    let (Some(lower), Some(upper), Verdict::Identified) =
        (interval.lower_95, interval.upper_95, interval.verdict)
    else {
        return;
    };
    let limit = found.best.cost + CHI_SQUARED_95;
    let good = ledger.run().iter().filter(|e| e.failure.is_none() && e.cost <= limit);
    let mut places: Vec<f64> = good.filter_map(|e| e.unit.get(axis).copied()).collect();
    places.sort_by(f64::total_cmp);
    let wide = GAP * (bounds.to_unit(upper) - bounds.to_unit(lower));
    let excluded = |from: f64, to: f64| {
        let above = interval.profile.iter().filter(|(_, cost)| *cost > limit);
        above.map(|(value, _)| bounds.to_unit(*value)).any(|u| from < u && u < to)
    };
    let gap = places.windows(2).find(|pair| pair[1] - pair[0] > wide && excluded(pair[0], pair[1]));
    let Some([below, above]) = gap.map(|pair| [pair[0], pair[1]].map(|u| bounds.from_unit(u))) else {
        return;
    };
    let [below, above] = [below, above].map(number);
    interval.bar(format!("values up to {below} and from {above} on meet the features about as well"));
    found.notes.push(format!(
        "{} is not called identified: values up to {below} and from {above} on meet the features about \
         as well, and none was found between them; add features that distinguish the two",
        names[axis]
    ));
}

const UNCONFIRMED: &str = "nothing is called identified: the searches for other values that are as good had not come to their end, \
    or found better points again and again; raise --max-evaluations, or global_evaluations and local_evaluations in [search], and go on with --resume";
