//! What the features say about the parameters at the best point: sensitivities, rank, linearised intervals, verdicts.
//!
//! Sensitivities are central differences in the unit box, in standard deviations of the features: `J = d r / d u`. A
//! singular direction of `J` is informative if its 95 % interval fits into the box. Intervals are those of the linear
//! model at the best point; they do not know of other minima, nor of bounds.

use super::ledger::Ledger;
use super::objective::{Evaluation, Objective, Target, residual};
use super::scale::clamp_unit;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Step of the differences in the unit box: about 2 % of a parameter whose bounds are a decade apart, well above the
/// scatter of features that are read from sampled traces.
pub const STEP: f64 = 0.01;
/// Half-width of a 95 % interval in standard deviations of a normal variable.
pub const Z_95: f64 = 1.96;
/// Smallest singular value, per length of the box, of an informative direction: its 95 % interval is as wide as the box.
pub const INFORMATIVE: f64 = 2.0 * Z_95;
/// Singular values below this share of the largest are rounding.
pub const ROUNDING: f64 = 1e-9;
/// Share (squared cosine) of uninformative directions in a parameter from which on the parameter is not identified.
pub const OPEN_SHARE: f64 = 0.01;
/// Nearer than this to a bound, in the unit box, the best point lies at it: the search resolves no less.
pub const AT_BOUND: f64 = 1e-3;

/// What is known of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Its interval lies within the bounds.
    Identified,
    /// Its interval reaches below the lower bound: only an upper limit is known.
    OpenBelow,
    /// Its interval reaches above the upper bound: only a lower limit is known.
    OpenAbove,
    /// The features say nothing about it alone.
    NotIdentified,
    /// The best value is a bound: the optimum may lie outside.
    AtBound,
}

impl Verdict {
    /// The word in files and summaries.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Identified => "identified",
            Self::OpenBelow => "open-below",
            Self::OpenAbove => "open-above",
            Self::NotIdentified => "not-identified",
            Self::AtBound => "at-bound",
        }
    }
}

/// Estimate and interval of one parameter, in its own SI unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Best value.
    pub estimate: f64,
    /// Lower end of the linearised 95 % interval; `None` where the features give none.
    pub lower_95: Option<f64>,
    /// Upper end of the linearised 95 % interval; `None` where the features give none.
    pub upper_95: Option<f64>,
    /// What is known.
    pub verdict: Verdict,
}

/// Everything found at the best point.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertainty {
    /// One a parameter, in job order.
    pub intervals: Vec<Interval>,
    /// Number of informative directions.
    pub rank: usize,
    /// Features that move by more than their own 95 % interval ([`INFORMATIVE`] standard deviations) over the box.
    pub informative_features: usize,
    /// `d ln feature / d ln parameter`, a row a feature, a column a parameter; `None` where either is missing or zero.
    pub sensitivities: Vec<Vec<Option<f64>>>,
    /// What a reader has to know, in sentences.
    pub notes: Vec<String>,
}

/// The points whose evaluations [`assess`] needs: two a parameter, one step below and above `best` where the box allows.
#[must_use]
pub fn points(best: &[f64]) -> Vec<Vec<f64>> {
    let moved = |axis: usize, step: f64| best.iter().enumerate().map(|(at, u)| if at == axis { clamp_unit(u + step) } else { *u }).collect();
    (0..best.len()).flat_map(|axis| [moved(axis, -STEP), moved(axis, STEP)]).collect()
}

/// The warning that fewer informative features than parameters deserve, before a search or after it.
#[must_use]
pub fn count_warning(features: usize, rank: Option<usize>, parameters: usize) -> Option<String> {
    let known = rank.map_or(features, |rank| rank.min(features));
    if known >= parameters {
        return None;
    }
    let (features_word, parameters_word) = (plural(features, "informative feature"), plural(parameters, "parameter"));
    let directions = match rank {
        Some(rank) => format!("they fix {}", plural(rank, "combination")),
        None => format!("they can fix at most {}", plural(features, "combination")),
    };
    Some(format!(
        "{features_word} for {parameters_word}: {directions} of the parameters and leave {} open; add features such as release-after-reversal, mean-deflection or rms, or take parameters out of the job",
        parameters - known
    ))
}

/// Gain in cost that a parameter's 95 % interval spans (chi-squared of one degree of freedom).
pub const CHI_SQUARED_95: f64 = 3.84;

/// Assesses the point `best`; `around` are the evaluations at [`points`], in their order, `tried` every evaluation of the search.
///
/// Intervals are linearised at the best point and widened to every tried point that is as good within [`CHI_SQUARED_95`].
#[must_use]
pub fn assess(objective: &Objective, names: &[String], best: &Evaluation, around: &[&Evaluation], tried: &[Evaluation]) -> Uncertainty {
    let slopes = slopes(objective.targets().len(), best, around);
    let jacobian = jacobian(objective.targets(), best, &slopes);
    let directions = Directions::of(&jacobian);
    let inflation = inflation(objective, best);
    let limit = best.cost + CHI_SQUARED_95 * inflation * inflation;
    let equals: Vec<&Evaluation> = tried.iter().filter(|e| e.failure.is_none() && e.cost <= limit).collect();
    let intervals: Vec<Interval> = (0..best.unit.len()).map(|axis| interval(objective, best, axis, &directions, inflation, &equals)).collect();
    let informative_features = jacobian.row_iter().filter(|row| row.norm() > INFORMATIVE).count();
    let mut notes = Vec::new();
    notes.extend(count_warning(informative_features, Some(directions.rank), names.len()));
    notes.extend(blind_notes(names, best, around));
    notes.push(
        "95 % intervals are linearised at the best point and widened to the equally good points that the search met: they do not see minima that it missed"
            .to_owned(),
    );
    if inflation > 1.0 {
        notes.push(format!("the features are missed by more than their standard deviations allow; intervals are widened {inflation:.2} times"));
    }
    Uncertainty { intervals, rank: directions.rank, informative_features, sensitivities: log_sensitivities(objective, best, &slopes), notes }
}

/// An assessment of a point around which nothing could be evaluated.
#[must_use]
pub fn unassessed(best: &Evaluation, why: &str) -> Uncertainty {
    let open = |estimate: &f64| Interval { estimate: *estimate, lower_95: None, upper_95: None, verdict: Verdict::NotIdentified };
    let notes = vec![format!("no intervals: {why}")];
    Uncertainty { intervals: best.values.iter().map(open).collect(), rank: 0, informative_features: 0, sensitivities: Vec::new(), notes }
}

/// `d ln|feature| / d u`, a row a feature; `None` where a feature is missing on both sides, or at the best point and on one.
pub(super) type Slopes = Vec<Vec<Option<f64>>>;

pub(super) fn slopes(features: usize, best: &Evaluation, around: &[&Evaluation]) -> Slopes {
    let of = |feature: usize, axis: usize| {
        let sides = [Some(best), around.get(2 * axis).copied(), around.get(2 * axis + 1).copied()];
        let [centre, below, above] = sides.map(|e| e.and_then(|e| Some((*e.unit.get(axis)?, e.features.get(feature)?.value()?))));
        difference(below.or(centre)?, above.or(centre)?)
    };
    (0..features).map(|feature| (0..best.unit.len()).map(|axis| of(feature, axis)).collect()).collect()
}

fn difference(below: (f64, f64), above: (f64, f64)) -> Option<f64> {
    let (width, ratio) = (above.0 - below.0, above.1 / below.1);
    (width > 0.0 && ratio > 0.0 && ratio.is_finite()).then(|| ratio.ln() / width)
}

/// `d r / d u`; zero where it is unknown. Rows of zeros are added so that there are as many rows as columns.
pub(super) fn jacobian(targets: &[Target], best: &Evaluation, slopes: &Slopes) -> DMatrix<f64> {
    let (rows, columns) = (targets.len(), best.unit.len());
    DMatrix::from_fn(rows.max(columns), columns, |row, column| {
        let slope = slopes.get(row).and_then(|s| s.get(column).copied()).flatten();
        targets.get(row).zip(slope).map_or(0.0, |(target, slope)| slope * target.value.abs() / target.sd)
    })
}

/// Singular directions of the Jacobian in the space of the parameters.
struct Directions {
    /// Singular value and direction; all of unit length and at right angles.
    all: Vec<(f64, Vec<f64>)>,
    /// Singular value above which a direction is informative.
    threshold: f64,
    rank: usize,
}

impl Directions {
    fn of(jacobian: &DMatrix<f64>) -> Self {
        let svd = jacobian.clone().svd(false, true);
        let rows = svd.v_t.iter().flat_map(|v_t| v_t.row_iter().map(|row| row.iter().copied().collect::<Vec<f64>>()).collect::<Vec<_>>());
        let all: Vec<(f64, Vec<f64>)> = svd.singular_values.iter().copied().zip(rows).collect();
        let largest = all.iter().map(|(value, _)| *value).fold(0.0, f64::max);
        let threshold = INFORMATIVE.max(ROUNDING * largest);
        let rank = all.iter().filter(|(value, _)| *value > threshold).count();
        Self { all, threshold, rank }
    }

    /// Standard deviation of a coordinate from the informative directions, and its share in the others.
    fn coordinate(&self, axis: usize) -> (f64, f64) {
        let component = |direction: &Vec<f64>| direction.get(axis).copied().unwrap_or(0.0).powi(2);
        let (known, open): (Vec<_>, Vec<_>) = self.all.iter().partition(|(value, _)| *value > self.threshold);
        let variance: f64 = known.iter().map(|(value, direction)| component(direction) / (value * value)).sum();
        (variance.sqrt(), open.iter().map(|(_, direction)| component(direction)).sum())
    }
}

/// Factor on the intervals when the misfit is larger than the standard deviations explain (Birge, Phys. Rev. 40 (1932) 207); at least 1.
fn inflation(objective: &Objective, best: &Evaluation) -> f64 {
    let squares: Vec<f64> = best.features.iter().zip(objective.targets()).filter_map(|(f, target)| Some(residual(f.value()?, target).powi(2))).collect();
    match squares.len().checked_sub(best.unit.len()) {
        Some(freedom) if freedom > 0 => (squares.iter().sum::<f64>() / freedom as f64).sqrt().max(1.0),
        _ => 1.0,
    }
}

fn interval(objective: &Objective, best: &Evaluation, axis: usize, directions: &Directions, inflation: f64, equals: &[&Evaluation]) -> Interval {
    let unit = best.unit.get(axis).copied().unwrap_or(0.5);
    let estimate = best.values.get(axis).copied().unwrap_or(f64::NAN);
    let (sd, open_share) = directions.coordinate(axis);
    let half = Z_95 * sd * inflation;
    let met = || equals.iter().filter_map(|e| e.unit.get(axis).copied());
    let (low, high) = (met().fold(unit - half, f64::min), met().fold(unit + half, f64::max));
    let known = open_share < OPEN_SHARE;
    let inside = |u: f64| (known && (0.0..=1.0).contains(&u)).then(|| objective.bounds().get(axis).map(|b| b.from_unit(u))).flatten();
    let at_bound = !(AT_BOUND..=1.0 - AT_BOUND).contains(&unit);
    let (lower_95, upper_95) = (inside(low), inside(high));
    let verdict = match (lower_95, upper_95) {
        _ if at_bound && known => Verdict::AtBound,
        (Some(_), Some(_)) => Verdict::Identified,
        (None, Some(_)) => Verdict::OpenBelow,
        (Some(_), None) => Verdict::OpenAbove,
        (None, None) => Verdict::NotIdentified,
    };
    Interval { estimate, lower_95, upper_95, verdict }
}

fn log_sensitivities(objective: &Objective, best: &Evaluation, slopes: &Slopes) -> Vec<Vec<Option<f64>>> {
    let per_log = |axis: usize, slope: Option<f64>| {
        let unit = best.unit.get(axis)?;
        Some(slope? / objective.bounds().get(axis)?.log_slope(*unit)?)
    };
    slopes.iter().map(|row| row.iter().enumerate().map(|(axis, slope)| per_log(axis, *slope)).collect()).collect()
}

/// Steps at which the model failed.
fn blind_notes(names: &[String], best: &Evaluation, around: &[&Evaluation]) -> Vec<String> {
    let sides = |axis: usize| around.iter().skip(2 * axis).take(2);
    let failed = |axis: usize| sides(axis).find_map(|e| e.failure.as_ref());
    let note = |(axis, name): (usize, &String)| {
        failed(axis).map(|f| {
            format!("the model fails ({}) one step of {STEP} of its range beside the best {name}; its sensitivities are one-sided or unknown", f.reason)
        })
    };
    names.iter().enumerate().take(best.unit.len()).filter_map(note).collect()
}

fn plural(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Evaluates [`points`] through the ledger and assesses its best point; `None` when the ledger is empty.
#[must_use]
pub fn at_best(ledger: &mut Ledger, objective: &Objective, names: &[String]) -> Option<Uncertainty> {
    let best = ledger.best()?.clone();
    if let Some(failure) = &best.failure {
        return Some(unassessed(&best, &format!("every evaluation failed, the best one with {failure}")));
    }
    match ledger.evaluate(super::journal::Stage::Sensitivity, &points(&best.unit)) {
        Ok(around) => {
            let around: Vec<Evaluation> = around.into_iter().cloned().collect();
            Some(assess(objective, names, &best, &around.iter().collect::<Vec<_>>(), ledger.run()))
        }
        Err(_) => Some(unassessed(&best, "the evaluations allowed were used up, or the fit was interrupted, before the sensitivities")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::objective::{Observed, Predict, RunFailure};
    use super::super::scale::{Bounds, Spacing};
    use super::*;

    struct Fake(fn(f64, f64) -> Result<Vec<f64>, RunFailure>);

    impl Predict for Fake {
        fn predict(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
            (self.0)(values[0], values[1]).map(|features| features.into_iter().map(Observed::Value).collect())
        }
    }

    /// Both parameters from 0.1 to 10, logarithmic; every target is 1 with the given standard deviation.
    fn at(fake: &Fake, sds: &[f64], unit: [f64; 2]) -> Uncertainty {
        let bounds = vec![Bounds::new(0.1, 10.0, Spacing::Log).unwrap(); 2];
        let targets = sds.iter().enumerate().map(|(i, sd)| Target { name: format!("f{i}"), value: 1.0, sd: *sd }).collect();
        let objective = Objective::new(bounds, targets, fake);
        let around: Vec<Evaluation> = points(&unit).iter().map(|p| objective.evaluate(p)).collect();
        assess(&objective, &["p".to_owned(), "q".to_owned()], &objective.evaluate(&unit), &around.iter().collect::<Vec<_>>(), &[])
    }

    #[test]
    fn an_interval_reaches_to_every_point_that_is_as_good() {
        // p^2 has its target at the middle of the box; a point far off in q costs nothing more
        let fake = Fake(|p, q| Ok(vec![p * p, if q > 5.0 { 1.0 } else { q }]));
        let bounds = vec![Bounds::new(0.1, 10.0, Spacing::Log).unwrap(); 2];
        let targets = ["f", "g"].map(|name| Target { name: name.to_owned(), value: 1.0, sd: 0.01 }).to_vec();
        let objective = Objective::new(bounds, targets, &fake);
        let around: Vec<Evaluation> = points(&[0.5, 0.5]).iter().map(|p| objective.evaluate(p)).collect();
        let (best, far) = (objective.evaluate(&[0.5, 0.5]), objective.evaluate(&[0.5, 0.9]));
        let upper = |tried: &[Evaluation]| {
            assess(&objective, &["p".to_owned(), "q".to_owned()], &best, &around.iter().collect::<Vec<_>>(), tried).intervals[1].upper_95.unwrap()
        };
        assert!(upper(&[]) < 1.1, "{}", upper(&[]));
        assert!((upper(&[far]) - 0.1 * 100.0_f64.powf(0.9)).abs() < 1e-9);
        assert!(upper(&[objective.evaluate(&[0.6, 0.9])]) < 1.1, "a point that costs more widens nothing");
    }

    #[test]
    fn intervals_of_powers_are_exact() {
        let found = at(&Fake(|p, q| Ok(vec![p * p, q.powi(-4)])), &[0.01, 0.02], [0.5, 0.5]);
        assert_eq!((found.rank, found.informative_features), (2, 2));
        for (interval, sd_ln) in found.intervals.iter().zip([0.01 / 2.0, 0.02 / 4.0]) {
            assert_eq!(interval.verdict, Verdict::Identified);
            assert!((interval.lower_95.unwrap().ln() + 1.96 * sd_ln).abs() < 1e-9 && (interval.upper_95.unwrap().ln() - 1.96 * sd_ln).abs() < 1e-9);
        }
        for (found, expected) in found.sensitivities.iter().flatten().zip([2.0, 0.0, 0.0, -4.0]) {
            assert!((found.unwrap() - expected).abs() < 1e-10);
        }
        assert_eq!(found.notes.len(), 1, "{:?}", found.notes);
    }

    #[test]
    fn one_feature_of_two_parameters_identifies_neither() {
        let found = at(&Fake(|p, q| Ok(vec![p * q])), &[0.01], [0.5, 0.5]);
        assert_eq!((found.rank, found.informative_features), (1, 1));
        assert!(found.intervals.iter().all(|i| (i.verdict, i.lower_95, i.upper_95) == (Verdict::NotIdentified, None, None)));
        assert!(
            found.notes[0].starts_with("1 informative feature for 2 parameters: they fix 1 combination of the parameters and leave 1 open"),
            "{}",
            found.notes[0]
        );
    }

    #[test]
    fn two_features_that_say_the_same_have_rank_one() {
        let found = at(&Fake(|p, q| Ok(vec![p * q, (p * q).powi(3)])), &[0.01, 0.01], [0.5, 0.5]);
        assert_eq!((found.rank, found.informative_features), (1, 2));
        assert!(found.notes[0].starts_with("2 informative features for 2 parameters: they fix 1 combination"));
    }

    #[test]
    fn an_insensitive_parameter_alone_is_not_identified() {
        let found = at(&Fake(|p, _| Ok(vec![p, p * p])), &[0.01, 0.01], [0.5, 0.5]);
        assert_eq!(found.intervals.iter().map(|i| i.verdict).collect::<Vec<_>>(), [Verdict::Identified, Verdict::NotIdentified]);
    }

    #[test]
    fn intervals_that_reach_a_bound_are_open_and_a_best_point_at_one_says_so() {
        let verdicts = |unit| {
            at(&Fake(|p, q| Ok(vec![p, q])), &[0.5, 0.01], unit)
                .intervals
                .iter()
                .map(|i| (i.verdict, i.lower_95.is_some(), i.upper_95.is_some()))
                .collect::<Vec<_>>()
        };
        assert_eq!(verdicts([0.1, 0.5]), [(Verdict::OpenBelow, false, true), (Verdict::Identified, true, true)]);
        assert_eq!(verdicts([0.9, 1.0]), [(Verdict::OpenAbove, true, false), (Verdict::AtBound, true, false)]);
        assert_eq!(verdicts([0.5, 0.0])[1], (Verdict::AtBound, false, true));
    }

    #[test]
    fn a_misfit_widens_the_intervals() {
        let exact = at(&Fake(|p, q| Ok(vec![p, q, q])), &[0.01; 3], [0.5, 0.5]);
        let off = at(&Fake(|p, q| Ok(vec![p, q, q * 0.05_f64.exp()])), &[0.01; 3], [0.5, 0.5]);
        let width = |u: &Uncertainty| u.intervals[0].upper_95.unwrap().ln();
        assert!((width(&off) / width(&exact) - 5.0).abs() < 1e-9);
        assert!(off.notes.iter().any(|n| n.contains("widened 5.00 times")), "{:?}", off.notes);
    }

    #[test]
    fn a_model_that_fails_on_one_side_is_differenced_on_the_other() {
        let found = at(&Fake(|p, q| if p > 1.001 { Err(RunFailure::new("jammed", "", 0.5)) } else { Ok(vec![p, q]) }), &[0.01, 0.01], [0.5, 0.5]);
        assert_eq!(found.rank, 2);
        assert!((found.sensitivities[0][0].unwrap() - 1.0).abs() < 1e-10);
        assert!(found.notes.iter().any(|n| n.contains("the model fails (jammed)") && n.contains("best p")), "{:?}", found.notes);
    }
}
