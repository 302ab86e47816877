use super::super::checkpoint::FitHeader;
use super::super::context::FitContext;
use super::super::evaluation::Observed;
use super::super::journal::{FitProgress, Journal};
use super::super::model::FeaturePredictor;
use super::*;
use crate::checkpoint::NullSink;
use crate::feature::ValueComparison;
use crate::fit::bounds::{Bounds, BoundsSpacing};
use crate::fit::evaluation::{FailureReason, RunFailure};
use crate::fit::job::FreeParameter;
use crate::fit::search::SearchSettings;
use crate::fit::target_value::TargetValue;
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::ops::ControlFlow;

/// A model with two parameters; in twins, the logarithms of its features scatter normally with the standard
/// deviations `sds`.
struct FakePredictor<'a> {
    features: fn(f64, f64) -> Result<Vec<f64>, RunFailure>,
    sds: &'a [f64],
}

impl FeaturePredictor for FakePredictor<'_> {
    fn predict_features(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
        (self.features)(values[0], values[1])
            .map(|features| features.into_iter().map(Observed::from_value).collect())
    }

    fn simulate_twin(&self, values: &[f64], draw: u64) -> Result<Vec<Observed>, RunFailure> {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(draw);
        let mut noisy = |(value, sd): (f64, &f64)| {
            Observed::from_value(value * (sd * generator.sample::<f64, _>(StandardNormal)).exp())
        };
        Ok((self.features)(values[0], values[1])?.into_iter().zip(self.sds).map(&mut noisy).collect())
    }
}

const LINEAR: IntervalSettings = IntervalSettings { profile: false, bootstrap: 0 };
const PROFILE: IntervalSettings = IntervalSettings { profile: true, bootstrap: 0 };
const BOTH: IntervalSettings = IntervalSettings { profile: true, bootstrap: 400 };

type Features = fn(f64, f64) -> Result<Vec<f64>, RunFailure>;

/// Assessment of two parameters, each on a logarithmic scale from 0.1 to 10. Every target is 1 with the
/// standard deviation in `sds`; the search ended at the point `unit`.
fn at(features: Features, sds: &[f64], unit: [f64; 2], settings: IntervalSettings) -> FitUncertainty {
    with(features, sds, &[unit], settings)
}

/// Like [`at`], after a search that evaluated the points `tried`.
fn with(features: Features, sds: &[f64], tried: &[[f64; 2]], settings: IntervalSettings) -> FitUncertainty {
    let axes = vec![FreeParameter::from(Bounds::new(0.1, 10.0, BoundsSpacing::Log).unwrap()); 2];
    let target = |(i, sd): (usize, &f64)| TargetValue {
        name: format!("f{i}"),
        value: 1.0,
        sd: *sd,
        scatter: 0.0,
        measure: ValueComparison::Log,
        last: false,
        calibration: None,
    };
    let fake = FakePredictor { features, sds };
    let objective = Objective::new(axes, sds.iter().enumerate().map(target).collect(), &fake);
    let (mut journal, mut watch) = (NullSink, |_: &FitProgress| ControlFlow::Continue(()));
    let journal = Journal::new(&FitContext::default(), FitHeader::default(), &mut journal, &mut watch);
    let mut ledger = Ledger::new(&objective, journal.unwrap());
    ledger
        .evaluate_points(EvaluationStage::Local, &tried.iter().map(|unit| unit.to_vec()).collect::<Vec<_>>())
        .unwrap();
    assess_best(&mut ledger, &["p".to_owned(), "q".to_owned()], &settings, 500).unwrap()
}

fn ln_ends(interval: &ParameterResult) -> [f64; 2] {
    [interval.lower_95.unwrap().ln(), interval.upper_95.unwrap().ln()]
}

#[test]
fn intervals_of_powers_are_exact_by_the_linear_model_and_by_profiles() {
    for settings in [LINEAR, PROFILE] {
        let found = at(|p, q| Ok(vec![p * p, q.powi(-4)]), &[0.01, 0.02], [0.5, 0.5], settings);
        assert_eq!((found.rank, found.informative_features), (2, 2));
        for (interval, sd_ln) in found.intervals.iter().zip([0.01 / 2.0, 0.02 / 4.0]) {
            assert_eq!(interval.verdict, ParameterVerdict::Identified);
            let half = CHI_SQUARED_95.sqrt() * sd_ln;
            // a crossing is interpolated linearly in the square root of the rise in cost, which is exact for
            // this parabolic cost
            assert!(
                ln_ends(interval)
                    .iter()
                    .zip([-half, half])
                    .all(|(found, expected)| (found - expected).abs() < 1e-3 * half),
                "{interval:?}"
            );
        }
        for (found, expected) in found.sensitivities.iter().flatten().zip([2.0, 0.0, 0.0, -4.0]) {
            assert!((found.unwrap() - expected).abs() < 1e-10);
        }
        assert!(found.notes.is_empty(), "{:?}", found.notes);
    }
}

#[test]
fn a_profile_lets_the_other_parameter_follow() {
    // ln p and ln(p q) have the standard deviations 0.02 and 0.01, so that of ln q is sqrt(0.02^2 + 0.01^2);
    // with p fixed it would be 0.01
    let found = at(|p, q| Ok(vec![p, p * q]), &[0.02, 0.01], [0.5, 0.5], PROFILE);
    let half = CHI_SQUARED_95.sqrt() * 0.02_f64.hypot(0.01);
    let [lower, upper] = ln_ends(&found.intervals[1]);
    assert!((upper / half - 1.0).abs() < 0.01 && (lower / half + 1.0).abs() < 0.01, "{lower} {upper} {half}");
    assert!((found.correlations[0][1].unwrap() + 0.02 / 0.02_f64.hypot(0.01)).abs() < 1e-9);
}

#[test]
fn what_is_correlated_with_a_parameter_at_its_bound_is_not_identified() {
    // the first target requires p = 0.05, below the bound of 0.1
    let follows = at(|p, q| Ok(vec![20.0 * p, 10.0 * p * q]), &[0.02, 0.01], [0.0, 0.5], PROFILE);
    assert_eq!(follows.intervals[1].verdict, ParameterVerdict::NotIdentified);
    assert!(
        follows.notes[0].starts_with("q is not called identified: p is at its bound"),
        "{:?}",
        follows.notes
    );
}

#[test]
fn a_bound_that_excludes_a_better_value_leaves_nothing_identified() {
    let excluding = at(|p, q| Ok(vec![20.0 * p, q]), &[0.02, 0.01], [0.0, 0.5], PROFILE);
    assert_eq!(excluding.intervals[1].verdict, ParameterVerdict::NotIdentified);
    let said = "nothing is called identified (q): p is at its bound, and a value beyond the bound would";
    assert!(excluding.notes[0].starts_with(said), "{:?}", excluding.notes);
    // in this case the optimum is exactly at the bound
    let met = at(|p, q| Ok(vec![10.0 * p, q]), &[0.02, 0.01], [0.0, 0.5], PROFILE);
    assert_eq!(met.intervals[1].verdict, ParameterVerdict::Identified);
}

#[test]
fn a_profile_is_not_symmetric_where_the_model_is_not() {
    // p^3 / 2 + p / 2 reaches its target at p = 1. The profile crosses the threshold where this feature has
    // changed by 1.96 standard deviations, not where a parabolic cost would cross it
    let found = at(|p, q| Ok(vec![p.powi(3) / 2.0 + p / 2.0, q]), &[0.3, 0.01], [0.5, 0.5], PROFILE);
    let rise = CHI_SQUARED_95.sqrt() * 0.3;
    let [lower, upper] = [found.intervals[0].lower_95.unwrap(), found.intervals[0].upper_95.unwrap()];
    let feature = |p: f64| (p.powi(3) / 2.0 + p / 2.0).ln();
    assert!(
        (feature(lower) / rise + 1.0).abs() < 0.03 && (feature(upper) / rise - 1.0).abs() < 0.03,
        "{lower} {upper}"
    );
}

#[test]
fn twins_scatter_as_the_deviations_say() {
    let found = at(|p, q| Ok(vec![p, p * q]), &[0.02, 0.01], [0.5, 0.5], BOTH);
    for (interval, sd) in found.intervals.iter().zip([0.02, 0.02_f64.hypot(0.01)]) {
        let [lower, upper] = interval.bootstrap_95.unwrap().map(f64::ln);
        // 400 twins give a standard deviation that is accurate to 3.5 %; three times this error is allowed
        assert!(((upper - lower) / 2.0 / (Z_95 * sd) - 1.0).abs() < 0.11, "{lower} {upper} {sd}");
    }
    assert_eq!(found.twins, 400);
    assert!((found.twin_sd[0].unwrap() / 0.02 - 1.0).abs() < 0.11);
}

#[test]
fn an_interval_reaches_to_every_point_that_is_as_good() {
    // p^2 reaches its target in the middle of the box; a point at a very different q has almost zero cost
    let features: Features = |p, q| Ok(vec![p * p, if (5.0..7.0).contains(&q) { 1.001 } else { q }]);
    let found = |tried: &[[f64; 2]], settings| {
        with(features, &[0.01, 0.01], &[&[[0.5, 0.5]], tried].concat(), settings).intervals[1].clone()
    };
    assert!(found(&[], PROFILE).upper_95.unwrap() < 1.1);
    let upper = found(&[[0.5, 0.9]], PROFILE).upper_95.unwrap();
    assert!((6.9..7.2).contains(&upper), "the profile goes on from that point: {upper}");
    let to_the_bound: Features = |p, q| Ok(vec![p * p, if q > 5.0 { 1.001 } else { q }]);
    let open = with(to_the_bound, &[0.01, 0.01], &[[0.5, 0.5], [0.5, 1.0]], LINEAR);
    assert_eq!(
        open.intervals[1].verdict,
        ParameterVerdict::OpenAbove,
        "an equal at a bound leaves the end open"
    );
    assert!(found(&[[0.6, 0.9]], PROFILE).upper_95.unwrap() < 1.1, "a point that costs more widens nothing");
}

#[test]
fn one_feature_of_two_parameters_identifies_neither() {
    for settings in [LINEAR, PROFILE] {
        let found = at(|p, q| Ok(vec![p * q]), &[0.01], [0.5, 0.5], settings);
        assert_eq!((found.rank, found.informative_features), (1, 1));
        assert!(
            found
                .intervals
                .iter()
                .all(|i| (i.verdict, i.lower_95, i.upper_95) == (ParameterVerdict::NotIdentified, None, None)),
            "{:?}",
            found.intervals
        );
        assert!(
            found.notes[0].starts_with("1 informative feature for 2 parameters: they fix 1 combination of the parameters and leave 1 open"),
            "{}",
            found.notes[0]
        );
        assert_eq!(found.combinations[0].describe(), "p q");
    }
}

#[test]
fn two_features_that_say_the_same_have_rank_one() {
    let found = at(|p, q| Ok(vec![p * q, (p * q).powi(3)]), &[0.01, 0.01], [0.5, 0.5], PROFILE);
    assert_eq!((found.rank, found.informative_features), (1, 2));
    assert!(found.notes[0].starts_with("2 informative features for 2 parameters: they fix 1 combination"));
}

#[test]
fn an_insensitive_parameter_alone_is_not_identified() {
    for settings in [LINEAR, BOTH] {
        let found = at(|p, _| Ok(vec![p, p * p]), &[0.01, 0.01], [0.5, 0.5], settings);
        assert_eq!(
            found.intervals.iter().map(|i| i.verdict).collect::<Vec<_>>(),
            [ParameterVerdict::Identified, ParameterVerdict::NotIdentified]
        );
    }
}

#[test]
fn a_parameter_that_only_stops_mattering_on_one_side_is_open_there() {
    // above q = 1 no feature changes; by the linear model alone the interval would have an upper end
    let features: Features = |p, q| Ok(vec![p, q.min(1.0)]);
    let found = at(features, &[0.01, 0.01], [0.5, 0.5], PROFILE);
    assert_eq!(found.intervals[1].verdict, ParameterVerdict::OpenAbove, "{:?}", found.intervals[1]);
    assert!((found.intervals[1].lower_95.unwrap().ln() + CHI_SQUARED_95.sqrt() * 0.01).abs() < 1e-3);
}

#[test]
fn intervals_that_reach_a_bound_are_open_and_a_best_point_at_one_says_so() {
    let verdicts = |features: Features, unit, settings| {
        let found = at(features, &[0.5, 0.01], unit, settings);
        found
            .intervals
            .iter()
            .map(|i| (i.verdict, i.lower_95.is_some(), i.upper_95.is_some()))
            .collect::<Vec<_>>()
    };
    for settings in [LINEAR, PROFILE] {
        let low = verdicts(|p, q| Ok(vec![p / (0.1 * 100.0_f64.powf(0.1)), q]), [0.1, 0.5], settings);
        assert_eq!(
            low,
            [(ParameterVerdict::OpenBelow, false, true), (ParameterVerdict::Identified, true, true)]
        );
        let high = verdicts(|p, q| Ok(vec![p / (0.1 * 100.0_f64.powf(0.9)), q / 10.0]), [0.9, 1.0], settings);
        assert_eq!(
            high,
            [(ParameterVerdict::OpenAbove, true, false), (ParameterVerdict::AtBound, true, false)]
        );
        assert_eq!(
            verdicts(|p, q| Ok(vec![p, q / 0.1]), [0.5, 0.0], settings)[1],
            (ParameterVerdict::AtBound, false, true)
        );
    }
}

#[test]
fn an_interval_that_ends_where_another_parameter_meets_its_bound_is_open() {
    // the only feature is p q: p can rise by the factor by which q can fall, and q is 10^0.2 times its lower
    // bound
    let features: Features = |p, q| Ok(vec![p * q / 0.1_f64 / 10.0_f64.powf(0.2)]);
    let found = at(features, &[0.01], [0.5, 0.1], PROFILE);
    let profile = &found.intervals[0].profile;
    assert!(profile.last().unwrap().1 > CHI_SQUARED_95, "the cost does rise: {profile:?}");
    assert_eq!((found.intervals[0].upper_95, found.intervals[0].profile_95[1]), (None, None));
}

#[test]
fn where_the_model_ends_nothing_is_identified() {
    // the only feature is p q, and the model fails for p above 3 or below 1/3
    let features: Features = |p, q| {
        if p.ln().abs() > 1.1 {
            Err(RunFailure::new(FailureReason::Ended(crate::simulate::RunStatus::ContactLost), "", 0.5))
        } else {
            Ok(vec![p * q])
        }
    };
    let found = at(features, &[0.01], [0.5, 0.5], PROFILE);
    let p = &found.intervals[0];
    assert!(p.lower_95.is_some() && p.upper_95.is_some(), "{p:?}");
    assert_eq!(p.verdict, ParameterVerdict::NotIdentified);
}

#[test]
fn a_better_point_on_the_way_is_followed() {
    // the search ended in a side valley of the cost, and the profile of q leads out of it
    let features: Features = |p, q| Ok(vec![p, q * (1.0 + 0.3 * (-((q - 1.6) / 0.2).powi(2)).exp())]);
    let found = at(features, &[0.01, 0.2], [0.5, 0.62], PROFILE);
    assert!((found.best.values[1] - 1.0).abs() < 0.02, "{:?}", found.best.values);
}

#[test]
fn a_misfit_that_one_search_alone_came_to_identifies_nothing() {
    let features: Features = |p, q| Ok(vec![p, q, q * 0.05_f64.exp()]);
    let fake = FakePredictor { features, sds: &[0.01; 3] };
    let target = |i: usize| TargetValue {
        name: format!("f{i}"),
        value: 1.0,
        sd: 0.01,
        scatter: 0.0,
        measure: ValueComparison::Log,
        last: false,
        calibration: None,
    };
    let axes = vec![FreeParameter::from(Bounds::new(0.1, 10.0, BoundsSpacing::Log).unwrap()); 2];
    let objective = Objective::new(axes, (0..3).map(target).collect(), &fake);
    let best = objective.evaluate(&[0.5, 0.5 - 0.025 / 100.0_f64.ln()]);
    // the sum of squares is 12.5 with one degree of freedom; by chance, one in a thousand exceeds 10.8
    assert!(
        check_best_point(&objective, &best, &[best.cost, best.cost + 4.0])
            .unwrap_err()
            .contains("a sum of squares of 12.5")
    );
    assert!(
        check_best_point(&objective, &best, &[best.cost, best.cost + 3.0]).is_ok(),
        "another search came to it"
    );
    assert!(check_best_point(&objective, &best, &[best.cost]).is_err(), "one search, and a misfit");
    let near = objective.with_feature_scatter(&[0.0, 0.01, 0.01]);
    let best = near.add_costs(best.into());
    assert!(check_best_point(&near, &best, &[best.cost]).is_ok(), "with deviations of 0.014 it is no misfit");
    assert!(
        check_best_point(&near, &best, &[best.cost, best.cost + 9.0]).is_err(),
        "another search ended elsewhere"
    );
}

#[test]
fn a_misfit_widens_the_deviations() {
    let features: Features = |p, q| Ok(vec![p, q, q * 0.05_f64.exp()]);
    let fake = FakePredictor { features, sds: &[0.01; 3] };
    let target = |i: usize| TargetValue {
        name: format!("f{i}"),
        value: 1.0,
        sd: 0.01,
        scatter: 0.0,
        measure: ValueComparison::Log,
        last: false,
        calibration: None,
    };
    let axes = vec![FreeParameter::from(Bounds::new(0.1, 10.0, BoundsSpacing::Log).unwrap()); 2];
    let objective = Objective::new(axes, (0..3).map(target).collect(), &fake);
    let (mut journal, mut watch) = (NullSink, |_: &FitProgress| ControlFlow::Continue(()));
    let journal = Journal::new(&FitContext::default(), FitHeader::default(), &mut journal, &mut watch);
    let mut ledger = Ledger::new(&objective, journal.unwrap());
    let best = vec![0.5, 0.5 - 0.025 / 100.0_f64.ln()];
    ledger.evaluate_points(EvaluationStage::Local, &[best]).unwrap();
    let found = weigh_features(&mut ledger).unwrap();
    // two features differ by 5 standard deviations, so each is 2.5 from their mean; there is one degree of
    // freedom
    assert!((found.inflation - 12.5_f64.sqrt()).abs() < 1e-6);
    assert!(
        found.scatter.iter().all(|scatter| (scatter.hypot(0.01) / 0.01 - 12.5_f64.sqrt()).abs() < 1e-6),
        "{found:?}"
    );
}

#[test]
fn a_feature_that_is_not_smooth_counts_for_less() {
    // the first feature jumps between 2 % above and 2 % below p; the standard deviation of its target is 1 %
    let features: Features =
        |p, q| Ok(vec![p * if (p.ln() * 43.0).rem_euclid(2.0) < 1.0 { 1.02 } else { 0.98 }, q]);
    let fake = FakePredictor { features, sds: &[0.01; 2] };
    let target = |i: usize| TargetValue {
        name: format!("f{i}"),
        value: 1.0,
        sd: 0.01,
        scatter: 0.0,
        measure: ValueComparison::Log,
        last: false,
        calibration: None,
    };
    let axes = vec![FreeParameter::from(Bounds::new(0.1, 10.0, BoundsSpacing::Log).unwrap()); 2];
    let objective = Objective::new(axes, (0..2).map(target).collect(), &fake);
    let (mut journal, mut watch) = (NullSink, |_: &FitProgress| ControlFlow::Continue(()));
    let journal = Journal::new(&FitContext::default(), FitHeader::default(), &mut journal, &mut watch);
    let mut ledger = Ledger::new(&objective, journal.unwrap());
    ledger.evaluate_points(EvaluationStage::Local, &[vec![0.5, 0.5]]).unwrap();
    let found = weigh_features(&mut ledger).unwrap();
    assert!(found.scatter[0] > 0.01 && found.scatter[1] < 1e-9, "{found:?}");
}

#[test]
fn a_model_that_fails_on_one_side_is_differenced_on_the_other() {
    let features: Features = |p, q| {
        if p > 1.001 {
            Err(RunFailure::new(FailureReason::Ended(crate::simulate::RunStatus::Jammed), "", 0.5))
        } else {
            Ok(vec![p, q])
        }
    };
    let found = at(features, &[0.01, 0.01], [0.5, 0.5], PROFILE);
    assert_eq!(found.rank, 2);
    assert!((found.sensitivities[0][0].unwrap() - 1.0).abs() < 1e-10);
    assert!(
        found.notes.iter().any(|n| n.contains("the model fails (jammed)") && n.contains("best p")),
        "{:?}",
        found.notes
    );
    let upper = found.intervals[0].upper_95.unwrap();
    assert!((1.0..1.01).contains(&upper), "what fails is outside: {upper}");
}

/// Like [`at`], followed by the searches for rival values.
fn confirmed_at(features: Features, sds: &[f64], unit: [f64; 2]) -> FitUncertainty {
    let axes = vec![FreeParameter::from(Bounds::new(0.1, 10.0, BoundsSpacing::Log).unwrap()); 2];
    let target = |(i, sd): (usize, &f64)| TargetValue {
        name: format!("f{i}"),
        value: 1.0,
        sd: *sd,
        scatter: 0.0,
        measure: ValueComparison::Log,
        last: false,
        calibration: None,
    };
    let fake = FakePredictor { features, sds };
    let objective = Objective::new(axes, sds.iter().enumerate().map(target).collect(), &fake);
    let (mut journal, mut watch) = (NullSink, |_: &FitProgress| ControlFlow::Continue(()));
    let journal = Journal::new(&FitContext::default(), FitHeader::default(), &mut journal, &mut watch);
    let mut ledger = Ledger::new(&objective, journal.unwrap());
    ledger.evaluate_points(EvaluationStage::Local, &[unit.to_vec()]).unwrap();
    let names = ["p".to_owned(), "q".to_owned()];
    let settings = SearchSettings {
        seed: 1,
        global_evaluations: 400,
        local_evaluations: 400,
        particles: 12,
        stagnation_generations: 20,
        starts: 2,
    };
    let found = assess_best(&mut ledger, &names, &PROFILE, 500).unwrap();
    confirm_identified(&mut ledger, &names, (&settings, &PROFILE), found)
}

#[test]
fn a_value_that_fits_as_well_at_twice_the_estimate_bars_identified() {
    // q = 1 and q = 2 give the same features, and the slopes at each of them imply that q is known to a
    // percent
    let folded: Features = |p, q| Ok(vec![p, 1.0 + (q - 1.0) * (q - 2.0) / 3.0]);
    let near = at(folded, &[0.01, 0.01], [0.5, 0.5], PROFILE);
    assert_eq!(near.intervals[1].verdict, ParameterVerdict::Identified);
    let found = confirmed_at(folded, &[0.01, 0.01], [0.5, 0.5]);
    assert_eq!(
        found.intervals.iter().map(|i| i.verdict).collect::<Vec<_>>(),
        [ParameterVerdict::Identified, ParameterVerdict::NotIdentified]
    );
    assert!((found.intervals[1].upper_95.unwrap() - 2.0).abs() < 0.1, "{:?}", found.intervals[1]);
    assert!(found.notes.iter().any(|note| note.starts_with("q is not called identified: ")));
}

#[test]
fn what_nothing_elsewhere_meets_stays_identified() {
    let found = confirmed_at(|p, q| Ok(vec![p * q, p / q]), &[0.01, 0.01], [0.5, 0.5]);
    assert!(
        found.intervals.iter().all(|i| i.verdict == ParameterVerdict::Identified) && found.notes.is_empty()
    );
}

#[test]
fn a_better_point_elsewhere_is_assessed_instead() {
    // at q = 5 the second feature equals its target; in the side valley at q = 1 it differs from its target
    // by two standard deviations
    let valleys: Features = |p, q| {
        let side = (q.ln() / 0.02).powi(2);
        let deep = ((q / 5.0).ln() / 0.02).powi(2);
        Ok(vec![p, (0.01 * (4.0 + side).min(deep).sqrt()).min(3.0).exp()])
    };
    let found = confirmed_at(valleys, &[0.01, 0.01], [0.5, 0.5]);
    assert!((found.best.values[1] / 5.0).ln().abs() < 0.05, "{:?}", found.best.values);
}
