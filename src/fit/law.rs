//! Which law of friction the recordings of a fit support, as `result.json` says it.

use super::findings::{FindingSource, FitFinding};
use crate::checkpoint::or_infinite;
use crate::model::friction::{FrictionLaw, FrictionShape};
use crate::model::parameters::{find_parameter, name_if_in_recording, symbol_with_recording};
use crate::simulate::scene::Scene;
use crate::text::{format_trimmed, join_with_and};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Word between the name of a law and its further terms.
pub(super) const TERM_SEPARATOR: &str = " with ";

/// Which law of friction the recordings support.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LawVerdict {
    /// One law, by odds of more than 20 to 1.
    Preferred,
    /// The recordings do not decide between several laws.
    Undecided,
    /// No law that was tried explains the recordings.
    NoneExplains,
}

/// Estimate of a parameter with a law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LawEstimate {
    /// Value in the SI unit of the parameter.
    pub estimate: f64,
    /// Standard deviation of the linear model, in the SI unit of the parameter; `None` if it is not known.
    pub sd: Option<f64>,
    /// Lower end of the 95 % interval of the linear model; `None` if it reaches the end of the range, or is
    /// not known.
    pub lower_95: Option<f64>,
    /// Upper end of the 95 % interval of the linear model; `None` if it reaches the end of the range, or is
    /// not known.
    pub upper_95: Option<f64>,
}

/// A law of friction that was fitted to the recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LawCandidate {
    /// Name of the law, followed by the keys of the further terms that are free.
    pub law: String,
    /// Whether the law explains the recordings.
    pub explains: bool,
    /// Chi2 per degree of freedom; infinite if a run of the model fails.
    #[serde(deserialize_with = "or_infinite")]
    pub chi2_per_dof: f64,
    /// Criterion of Schwarz, minus that of the chosen law; `None` if the law explains nothing.
    pub criterion: Option<f64>,
    /// Whether the recordings do not decide against the law.
    pub possible: bool,
    /// Estimates with this law: those of its free parameters, and for each free parameter of the job that
    /// this law lacks the nearest value.
    pub parameters: BTreeMap<String, LawEstimate>,
}

/// Comparison of friction laws.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LawComparison {
    /// The verdict.
    pub verdict: LawVerdict,
    /// Name of the law with the lowest criterion; `None` if no law explains the recordings.
    pub chosen: Option<String>,
    /// The verdict in words.
    pub sentence: String,
    /// All laws that were tried; the law of the scene is the first.
    pub candidates: Vec<LawCandidate>,
}

impl LawComparison {
    /// The comparison of `candidates`, whose criterion is known; the first is the law of the scene.
    pub(super) fn judge(candidates: Vec<LawCandidate>) -> Self {
        let possible: Vec<&LawCandidate> = candidates.iter().filter(|one| one.possible).collect();
        let chosen = candidates.iter().find(|one| one.criterion == Some(0.0)).map(|one| one.law.clone());
        let list = |list: &[&LawCandidate]| {
            join_with_and(&list.iter().map(|one| one.describe()).collect::<Vec<_>>())
        };
        let all: Vec<&LawCandidate> = candidates.iter().collect();
        let (verdict, sentence) = match (&possible[..], &all[..]) {
            ([one], [own, others @ ..]) if one.law == own.law => {
                let assumed: String = others.iter().map(|other| own.describe_assumption(other)).collect();
                let words = format!("{} is preferred to {}", own.describe(), list(others));
                (LawVerdict::Preferred, words + &assumed)
            }
            ([one], [own, ..]) => {
                let worse = if own.explains {
                    "fits clearly worse than"
                } else {
                    "does not explain the recording, unlike"
                };
                let terms = one.describe_terms(own);
                (LawVerdict::Preferred, format!("{} {worse} {}{terms}", own.describe(), one.describe()))
            }
            ([], _) | (_, []) => {
                let words = format!("none of {} explains the recording", list(&all));
                let advice = if all.len() > 2 { "" } else { "; `laws` of the job names others" };
                (LawVerdict::NoneExplains, words + advice)
            }
            (several, [own, ..]) => {
                let lost = if own.possible {
                    String::new()
                } else {
                    format!("; {} fits clearly worse", own.describe())
                };
                let words = format!("the recording does not decide between {}{lost}", list(several));
                (LawVerdict::Undecided, words)
            }
        };
        let sentence = format!("Law of friction: {sentence}.");
        Self { verdict, chosen, sentence, candidates }
    }

    /// What explains recordings that the fit does not explain, as a finding: other values with the law of the
    /// scene, or another law.
    pub(super) fn find_explanation(&self) -> Option<FitFinding> {
        let own = self.candidates.first()?;
        if own.possible {
            let values = own.parameters.iter().map(|(name, found)| found.describe(name)).collect::<Vec<_>>();
            let sentence = format!(
                "Explained with values that no start of the search reached, {}: fit again with narrower bounds",
                join_with_and(&values)
            );
            return Some(FitFinding {
                hypothesis: Some("missed-minimum".to_owned()),
                explains: Some(true),
                chi2_per_dof: Some(own.chi2_per_dof),
                ..FitFinding::new(FindingSource::Hypothesis, sentence)
            });
        }
        let best = self.candidates.iter().find(|one| Some(&one.law) == self.chosen.as_ref())?;
        let sentence =
            format!("Explained if friction follows {}{}", best.describe(), best.describe_terms(own));
        Some(FitFinding {
            hypothesis: Some("friction-law".to_owned()),
            explains: Some(true),
            chi2_per_dof: Some(best.chi2_per_dof),
            ..FitFinding::new(FindingSource::Hypothesis, sentence)
        })
    }
}

impl LawCandidate {
    /// The further terms of the law in words, such as " with a rise with speed"; empty without any.
    fn describe_further_terms(&self) -> String {
        let terms = self
            .law
            .split_once(TERM_SEPARATOR)
            .map(|(_, terms)| format!("{TERM_SEPARATOR}{terms}"))
            .unwrap_or_default();
        let terms = terms.replace("static_ratio", "a higher limit at rest");
        terms.replace("viscous_s_per_m", "a rise with speed")
    }

    /// Name of the law, without its further terms.
    fn shape_name(&self) -> &str {
        self.law.split(TERM_SEPARATOR).next().unwrap_or_default()
    }

    /// The law as a label, such as "exponential law with a rise with speed".
    pub(crate) fn format_label(&self) -> String {
        // Stribeck is a person
        let name = self.shape_name().replace("stribeck", "Stribeck");
        format!("{name} law{}", self.describe_further_terms())
    }

    /// The law in words, such as "the exponential law with a rise with speed".
    pub(super) fn describe(&self) -> String {
        format!("the {}", self.format_label())
    }

    /// The law with its estimates in a condition with this scene; `None` if the scene refuses the law.
    pub(crate) fn friction_law(&self, scene: &Scene, condition: usize) -> Option<FrictionLaw> {
        let shape = FrictionShape::from_name(self.shape_name()).unwrap_or(scene.linkage.friction.shape);
        let mut scene = scene.with_friction_shape(shape).ok()?;
        for (name, found) in self.parameters.iter().filter(|(name, _)| name.starts_with("friction.")) {
            let key = name_if_in_recording(name, condition).filter(|key| shape.has_parameter(key));
            if let Some(key) = key {
                scene = scene.with_parameter(key, found.estimate).ok()?;
            }
        }
        Some(scene.linkage.friction)
    }

    /// The parameters of the law that `own` lacks with their values, such as ": rs = 1.05 (1.04 to 1.06)".
    fn describe_terms(&self, own: &Self) -> String {
        let new = self.parameters.iter().filter(|(name, _)| !own.parameters.contains_key(*name));
        let words: Vec<String> = new.map(|(name, found)| found.describe(name)).collect();
        if words.is_empty() { String::new() } else { format!(": {}", join_with_and(&words)) }
    }

    /// A sentence on the parameters whose intervals hold for this law without the further terms of `other`:
    /// with them they move by more than a standard deviation, or their intervals are more than twice as wide.
    /// Empty if `other` has no further terms.
    fn describe_assumption(&self, other: &Self) -> String {
        let depends = |(name, own): &(&String, &LawEstimate)| {
            let with_terms = other.parameters.get(*name).zip(own.sd);
            with_terms.is_some_and(|(with_terms, sd)| with_terms.departs_from(own.estimate, sd))
        };
        let words =
            |(name, _): (&String, &LawEstimate)| other.parameters.get(name).map(|found| found.describe(name));
        let words: Vec<String> = self.parameters.iter().filter(depends).filter_map(words).collect();
        let (terms, words) = (other.describe_further_terms(), join_with_and(&words));
        if words.is_empty() || terms.is_empty() || !other.explains {
            return String::new();
        }
        format!(". The intervals assume this law;{terms} they would be {words}")
    }
}

impl LawEstimate {
    /// Whether the estimate differs from that of another law by more than the standard deviation `sd` of the
    /// other law, or is known less than half as well.
    pub(super) fn departs_from(&self, estimate: f64, sd: f64) -> bool {
        const WIDER: f64 = 2.0;
        (self.estimate - estimate).abs() > sd || self.sd.is_some_and(|own| own > WIDER * sd)
    }

    /// The value with its interval, such as "A = 0.108 (0.102 to 0.115)".
    fn describe(&self, name: &str) -> String {
        let symbol = symbol_with_recording(name).unwrap_or_else(|| name.to_owned());
        let unit = find_parameter(name).map_or("1", |row| row.unit);
        let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
        let number = |value: f64| format_trimmed(value, 3);
        let ends = match (self.lower_95, self.upper_95) {
            (Some(low), Some(high)) => format!(" ({} to {})", number(low), number(high)),
            (Some(low), None) => format!(" (at least {})", number(low)),
            (None, Some(high)) => format!(" (at most {})", number(high)),
            (None, None) => String::new(),
        };
        format!("{symbol} = {}{unit}{ends}", number(self.estimate))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::fit::trace::Z_95;

    /// A law whose parameters have a standard deviation of a tenth.
    fn candidate(law: &str, criterion: Option<f64>, parameters: &[(&str, f64)]) -> LawCandidate {
        let estimate = |value: f64| LawEstimate {
            estimate: value,
            sd: Some(0.1),
            lower_95: Some(value - 0.1 * Z_95),
            upper_95: Some(value + 0.1 * Z_95),
        };
        LawCandidate {
            law: law.to_owned(),
            explains: criterion.is_some(),
            chi2_per_dof: 1.0,
            criterion,
            possible: criterion.is_some_and(|rise| rise < 6.0),
            parameters: parameters
                .iter()
                .map(|(name, value)| ((*name).to_owned(), estimate(*value)))
                .collect(),
        }
    }

    const TERMS: &str = "exponential with static_ratio and viscous_s_per_m";

    pub(in crate::fit) fn judge(own: Option<f64>, other: Option<f64>) -> LawComparison {
        let own = candidate("exponential", own, &[("friction.a", 0.5), ("friction.c", 0.3)]);
        let terms = [("friction.a", 0.8), ("friction.c", 0.35), ("friction.static_ratio", 1.2)];
        LawComparison::judge(vec![own, candidate(TERMS, other, &terms)])
    }

    #[test]
    fn a_law_wins_by_odds_of_twenty() {
        let verdict = |own, other| {
            let found = judge(own, other);
            (found.verdict, found.chosen)
        };
        let [own, other] = ["exponential", TERMS].map(|law| Some(law.to_owned()));
        assert_eq!(verdict(Some(0.0), Some(6.1)), (LawVerdict::Preferred, own.clone()));
        assert_eq!(verdict(Some(0.0), Some(5.9)), (LawVerdict::Undecided, own.clone()));
        assert_eq!(verdict(Some(5.9), Some(0.0)), (LawVerdict::Undecided, other.clone()));
        assert_eq!(verdict(Some(6.1), Some(0.0)), (LawVerdict::Preferred, other.clone()));
        assert_eq!(verdict(None, Some(0.0)), (LawVerdict::Preferred, other));
        assert_eq!(verdict(Some(0.0), None), (LawVerdict::Preferred, own));
        assert_eq!(verdict(None, None), (LawVerdict::NoneExplains, None));
    }

    #[test]
    fn the_verdict_is_one_sentence() {
        let terms = "the exponential law with a higher limit at rest and a rise with speed";
        let sentence = |own, other| judge(own, other).sentence;
        assert_eq!(
            sentence(Some(0.0), Some(9.0)),
            format!(
                "Law of friction: the exponential law is preferred to {terms}. The intervals assume this law; \
                 with a higher limit at rest and a rise with speed they would be A = 0.8 (0.604 to 0.996)."
            )
        );
        assert_eq!(
            sentence(None, Some(0.0)),
            format!(
                "Law of friction: the exponential law does not explain the recording, unlike {terms}: \
                 rs = 1.2 (1 to 1.4)."
            )
        );
        assert!(
            sentence(Some(9.0), Some(0.0)).contains("law fits clearly worse than the exponential law with")
        );
        assert!(
            sentence(Some(1.0), Some(0.0)).contains("does not decide between the exponential law and the")
        );
        assert!(sentence(None, None).starts_with("Law of friction: none of the exponential law and the"));
        let words = judge(None, Some(0.0)).find_explanation().unwrap().sentence;
        assert_eq!(words, format!("Explained if friction follows {terms}: rs = 1.2 (1 to 1.4)"));
        let missed = judge(Some(0.0), Some(9.0)).find_explanation().unwrap().sentence;
        assert!(
            missed.starts_with("Explained with values that no start of the search reached, A = 0.5"),
            "{missed}"
        );
    }
}
