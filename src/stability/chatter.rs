//! Where and why a blade or slider chatters, in numbers and in words: the part whose natural frequency is
//! nearest to that of the cycle, and how much the growth by falling friction exceeds the decay by damping.

use super::changes::{find_boundary, number_change};
use super::cycle_branch::{CycleBranch, CycleEnd};
use super::journal::{EvaluationLog, StudyStop};
use super::steady_sliding::SlideFinder;
use super::study::{StabilityStudy, StudyRange, default_top_speed};
use crate::model::Linkage;
use crate::model::friction::FrictionLaw;
use crate::model::modes::named_frequencies;
use crate::model::parameter_spread::ParameterSpread;
use crate::model::parameters::find_parameter;
use crate::simulate::scene::Scene;
use crate::text::{format_digits, format_interval, format_short};
use portable_math as math;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Cause of the chatter at a speed.
#[derive(Debug, Clone)]
pub struct ChatterCause {
    /// Speed of the head, m/s: half of that at which the instability ends or, without an
    /// instability, of that at which the cycle ends.
    pub speed_m_per_s: f64,
    /// Number of vibrations in a period: that of the sticks, but at least 1.
    vibrations: f64,
    /// The part whose natural frequency is nearest: head, neck or lip, the neck on the shoulder, or a slider.
    pub part: String,
}

impl ChatterCause {
    /// The cause of the cycle of a scene. `unstable` are the speeds, m/s, between which steady sliding is
    /// unstable; the cause is examined at half of the higher one, or of the speed at which the cycle ends.
    pub(super) fn from_branch(
        scene: &Scene,
        branch: &CycleBranch,
        unstable: Option<[f64; 2]>,
    ) -> Option<Self> {
        let wanted = 0.5 * unstable.map_or(branch.end_m_per_s, |[_, end]| end);
        // the points of the branch lie apart by steps that grow with the range of speeds
        let cycle = branch.find_cycle(scene, wanted).or_else(|| branch.nearest_cycle(wanted).cloned())?;
        let vibrations = cycle.sticks_s.len().max(1) as f64;
        let distance = |hz: f64| math::ln(hz / (vibrations * cycle.frequency_hz())).abs();
        let parts = natural_frequencies(&scene.linkage).into_iter();
        let (part, _) = parts.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)))?;
        Some(Self { speed_m_per_s: cycle.speed_m_per_s, vibrations, part })
    }
}

/// Natural frequencies of the parts, Hz, also of the neck on the shoulder.
fn natural_frequencies(linkage: &Linkage) -> Vec<(String, f64)> {
    let mut parts = named_frequencies(linkage);
    let neck = parts.iter().find(|(name, _)| name == "neck").map(|(_, hz)| *hz);
    if let (Some(shoulder), Some(free_hz)) = (&linkage.shoulder, neck) {
        let stiffer = 1.0 + shoulder.stiffness_n_m_per_rad / linkage.neck.stiffness;
        parts.push(("neck on the shoulder".to_owned(), free_hz * stiffer.sqrt()));
    }
    parts
}

/// Change of the friction coefficient per change of the speed, s/m.
fn friction_slope(linkage: &Linkage, direction: f64, speed: f64) -> f64 {
    let law = &linkage.friction;
    let falling = law.a * law.b_s_per_m * law.varying_part(speed)[1];
    law.direction_factor(direction) * (falling + law.viscous_s_per_m)
}

/// Growth by falling friction of the mode of steady sliding that grows fastest or decays most slowly, divided
/// by its decay if friction had the same value but did not change with speed. `None` if there is no such
/// decay, or no steady sliding.
fn feeding_over_damping(linkage: &Linkage, direction: f64, speed: f64) -> Option<f64> {
    let mode = SlideFinder::new(linkage, direction).find_slide(speed).ok()?.leading_mode();
    let mut level = *linkage;
    let mu = linkage.friction.dynamic_coefficient(speed, direction);
    level.friction = FrictionLaw::exponential(0.0, 0.0, mu);
    let still = SlideFinder::new(&level, direction).find_slide(speed).ok()?;
    let far = |hz: f64| (hz - mode.frequency_hz).abs();
    let same = still.modes.iter().min_by(|a, b| far(a.frequency_hz).total_cmp(&far(b.frequency_hz)))?;
    let damping = -same.growth_per_s;
    (damping > 0.0).then(|| (mode.growth_per_s + damping) / damping)
}

/// A number of the chatter of a blade or slider.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum ChatterNumber {
    /// Lowest speed at which steady sliding is unstable, m/s.
    #[serde(rename = "onset_m_per_s")]
    Onset,
    /// Highest speed at which steady sliding is unstable, m/s.
    #[serde(rename = "end_m_per_s")]
    End,
    /// Speed at which the stick-slip cycle ends, m/s.
    #[serde(rename = "cycle_fold_m_per_s")]
    CycleFold,
    /// Frequency of the cycle at the speed of the cause, Hz.
    #[serde(rename = "cycle_hz")]
    CycleFrequency,
    /// Natural frequency of the part that the cycle feeds on, Hz.
    #[serde(rename = "natural_hz")]
    NaturalFrequency,
    /// Change of the friction coefficient per change of the speed, s/m.
    #[serde(rename = "friction_slope_s_per_m")]
    FrictionSlope,
    /// Growth by falling friction, divided by the decay at constant friction.
    #[serde(rename = "feeding_over_damping")]
    Feeding,
}

impl ChatterNumber {
    const ALL: [Self; 7] = [
        Self::Onset,
        Self::End,
        Self::CycleFold,
        Self::CycleFrequency,
        Self::NaturalFrequency,
        Self::FrictionSlope,
        Self::Feeding,
    ];
}

/// A number with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ChatterEstimate {
    /// The number.
    pub value: f64,
    /// Half width of its 95 % interval; `None` without a fit, if the fit does not determine a parameter on
    /// which the number depends, or if the number is an end of the range of speeds.
    pub half_95: Option<f64>,
}

impl ChatterEstimate {
    /// Whether the 95 % interval includes a value.
    fn includes(&self, value: f64) -> bool {
        self.half_95.is_some_and(|half| (self.value - value).abs() <= half)
    }

    fn describe_value(&self, unit: &str) -> String {
        /// Least and largest number of digits.
        const DIGITS: [i32; 2] = [3, 6];
        // the first digit of the half width is the last that is shown
        let digits = self.half_95.filter(|half| *half > 0.0).map_or(DIGITS[0], |half| {
            (math::log10(self.value.abs() / half).floor() as i32 + 1).clamp(DIGITS[0], DIGITS[1])
        });
        let words =
            |value: f64| if value == 0.0 { "0".to_owned() } else { format_digits(value, digits as usize) };
        let value = words(self.value);
        match self.half_95.map(|half| [self.value - half, self.value + half]) {
            // an interval that rounds to the value is left out
            Some([low, high]) if words(low) != words(high) => {
                format!("{value}{unit} ({})", format_interval(Some(low), Some(high), words))
            }
            _ => format!("{value}{unit}"),
        }
    }
}

/// A change of one parameter that lowers the speed at which chatter ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CycleRemedy {
    /// Name of the parameter, one of blade, shoulder or slider.
    pub parameter: String,
    /// Factor on its value.
    pub factor: f64,
    /// The speed at which the cycle of the changed blade or slider ends, m/s, computed for the changed value;
    /// `None` if no cycle is found and steady sliding is stable.
    pub cycle_fold_m_per_s: Option<f64>,
}

/// Where and why a blade or slider chatters, and what ends it soonest.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ChatterSummary {
    /// In words.
    pub sentences: Vec<String>,
    /// The part that the cycle feeds on; `None` without a cycle.
    pub part: Option<String>,
    /// Speed of the head at which the cause is examined, m/s; `None` without a cycle.
    pub speed_m_per_s: Option<f64>,
    /// The numbers that are known.
    pub numbers: BTreeMap<ChatterNumber, ChatterEstimate>,
    /// The change after which the cycle ends at the lowest speed.
    pub remedy: Option<CycleRemedy>,
}

impl ChatterSummary {
    /// Summarises the chatter of a scene at speeds from 0 to twice the highest speed of its drive. `None` if
    /// the head is at rest.
    #[must_use]
    pub fn from_scene(scene: &Scene, spread: &ParameterSpread) -> Option<Self> {
        /// Number of speeds at which the growth is computed.
        const POINTS: usize = 100;
        let top = Some(default_top_speed(scene)).filter(|top| *top > 0.0)?;
        let range = StudyRange { speeds_m_per_s: [0.0, top], preloads_n: None, points: POINTS };
        let log = &mut EvaluationLog::without_journal();
        StabilityStudy::from_scene(scene, range, log).ok()?.summarise_chatter(scene, Some(spread), log).ok()
    }
}

impl StabilityStudy {
    /// Summarises a study of a scene. `spread` is the uncertainty of the scene's parameters after a fit.
    ///
    /// # Errors
    /// [`StudyStop`] if the log stops the study.
    pub fn summarise_chatter(
        &self,
        scene: &Scene,
        spread: Option<&ParameterSpread>,
        log: &mut EvaluationLog<'_>,
    ) -> Result<ChatterSummary, StudyStop> {
        let mut numbers = BTreeMap::new();
        for which in ChatterNumber::ALL {
            let Some(value) = self.chatter_number(which, scene) else { continue };
            let half_95 = match spread {
                Some(spread) => self.propagate_number(which, value, scene, spread, log)?,
                None => None,
            };
            numbers.insert(which, ChatterEstimate { value, half_95 });
        }
        let mut summary = ChatterSummary {
            sentences: Vec::new(),
            part: self.cause.as_ref().map(|cause| cause.part.clone()),
            speed_m_per_s: self.cause.as_ref().map(|cause| cause.speed_m_per_s),
            numbers,
            remedy: self.remedy.clone(),
        };
        // an end of the range of speeds has no interval even if the fit determines all parameters
        let is_open = |which| summary.numbers.get(&which).is_some_and(|known| known.half_95.is_none());
        let open = [ChatterNumber::CycleFrequency, ChatterNumber::FrictionSlope, ChatterNumber::Feeding];
        let doubt = (spread.is_some() && open.into_iter().any(is_open))
            .then(|| "Numbers without an interval depend on what the fit does not determine.".to_owned());
        summary.sentences = [Some(self.describe_speeds(&summary)), describe_cause(&summary), doubt]
            .into_iter()
            .flatten()
            .collect();
        Ok(summary)
    }

    /// A number of the scene of this study; `None` if it is not known.
    fn chatter_number(&self, which: ChatterNumber, scene: &Scene) -> Option<f64> {
        match which {
            ChatterNumber::Onset => self.unstable_range().map(|[onset, _]| onset),
            ChatterNumber::End => self.unstable_range().map(|[_, end]| end),
            ChatterNumber::CycleFold => self.leading_branch()?.fold_m_per_s(),
            _ => self.find_number(which, scene),
        }
    }

    /// A number of a scene that differs little from that of this study; `None` if it is not found. An end of
    /// the range of speeds is not found.
    fn find_number(&self, which: ChatterNumber, scene: &Scene) -> Option<f64> {
        let (range, linkage) = (self.unstable_range(), &scene.linkage);
        let direction = self.leading_direction();
        let [lowest, highest] = self.range.speeds_m_per_s;
        let boundary = |speed: f64, inwards| find_boundary(linkage, direction, speed, inwards);
        let cause = self.cause.as_ref();
        match which {
            ChatterNumber::Onset => boundary(range?[0], 1.0).filter(|_| range.is_some_and(|r| r[0] > lowest)),
            ChatterNumber::End => boundary(range?[1], -1.0).filter(|_| range.is_some_and(|r| r[1] < highest)),
            ChatterNumber::CycleFold => self.leading_branch()?.find_changed_end(scene),
            ChatterNumber::CycleFrequency => {
                let cycle = self.leading_branch()?.find_cycle(scene, cause?.speed_m_per_s)?;
                Some(cause?.vibrations * cycle.frequency_hz())
            }
            ChatterNumber::NaturalFrequency => {
                let (part, mut parts) = (&cause?.part, natural_frequencies(linkage).into_iter());
                parts.find(|(name, _)| name == part).map(|(_, hz)| hz)
            }
            ChatterNumber::FrictionSlope => Some(friction_slope(linkage, direction, cause?.speed_m_per_s)),
            ChatterNumber::Feeding => feeding_over_damping(linkage, direction, cause?.speed_m_per_s),
        }
    }

    /// Half width of the 95 % interval of a number.
    fn propagate_number(
        &self,
        which: ChatterNumber,
        value: f64,
        scene: &Scene,
        spread: &ParameterSpread,
        log: &mut EvaluationLog<'_>,
    ) -> Result<Option<f64>, StudyStop> {
        /// Smallest step, as a fraction of the value of a parameter. A number that changes by less than
        /// `NOTHING` of its value in such a step does not depend on the parameter.
        const LEAST_STEP: f64 = 0.01;
        const NOTHING: f64 = 1e-6;
        let compute = |name: &str, half: &Option<f64>| {
            let at = scene.value(name)?;
            let step = half.unwrap_or(0.0).max(LEAST_STEP * at.abs());
            let change =
                number_change(scene, name, [at, step], value, |scene| self.find_number(which, scene))?;
            match half {
                _ if change.abs() < NOTHING * value.abs() => Some(0.0),
                Some(half) => Some(change * half / step),
                None => None,
            }
        };
        let mut moved = Vec::new();
        for (name, half) in spread.names.iter().zip(&spread.halves_95) {
            match log.evaluate(format!("{which:?} by {name}"), || compute(name, half))? {
                Some(change) => moved.push(change),
                None => return Ok(None),
            }
        }
        Ok(spread.propagate_95(&moved))
    }

    /// At which speeds the blade chatters, and what ends it soonest.
    fn describe_speeds(&self, found: &ChatterSummary) -> String {
        let number = |which| found.numbers.get(&which);
        let speed = |which| number(which).map_or_else(String::new, |known| known.describe_value(" m/s"));
        let [lowest, highest] = self.range.speeds_m_per_s;
        let top = format_digits(highest, 3);
        let from =
            if lowest > 0.0 { format!("from {} m/s ", format_digits(lowest, 3)) } else { String::new() };
        if let Some(reason) = self.why_impossible() {
            return format!("Steady sliding is impossible {from}up to {top} m/s: {}.", reason.meaning());
        }
        let onset = speed(ChatterNumber::Onset);
        let sliding = match self.unstable_range() {
            None => format!("Steady sliding is stable {from}up to {top} m/s, the highest speed examined"),
            Some([start, end]) if start == lowest && lowest > 0.0 && end == highest => {
                format!("Steady sliding is unstable at all speeds examined, from {onset} to {top} m/s")
            }
            Some([_, end]) if end == highest => {
                format!("Steady sliding is unstable from {onset} up to {top} m/s, the highest speed examined")
            }
            Some([start, _]) if start == lowest && lowest > 0.0 => {
                let end = speed(ChatterNumber::End);
                format!("Steady sliding is unstable from {onset}, the lowest speed examined, to {end}")
            }
            Some(_) => format!("Steady sliding is unstable from {onset} to {}", speed(ChatterNumber::End)),
        };
        let doubt = match number(ChatterNumber::End) {
            Some(end) if end.includes(0.0) => "; whether it is unstable at all is undecided",
            _ => "",
        };
        let cycle = match self.leading_branch() {
            None => "no stick-slip cycle of equal periods was found".to_owned(),
            Some(branch) => match branch.end {
                CycleEnd::EndOfRange => format!("a stick-slip cycle goes on beyond {top} m/s"),
                CycleEnd::Undecided => "the speed at which the stick-slip cycle ends is undecided".to_owned(),
                _ => format!("a stick-slip cycle goes on up to {}", speed(ChatterNumber::CycleFold)),
            },
        };
        let remedy = self.remedy.as_ref().map_or_else(String::new, |remedy| {
            let meaning = find_parameter(&remedy.parameter).map_or("", |parameter| parameter.meaning);
            let meaning = meaning.split(',').next().unwrap_or_default();
            let ends = remedy.cycle_fold_m_per_s.map_or_else(
                || "would not occur".to_owned(),
                |speed| format!("would end at {} m/s", format_digits(speed, 3)),
            );
            format!("; with {} times the {meaning} it {ends}", format_short(remedy.factor))
        });
        format!("{sliding}{doubt}; {cycle}{remedy}.")
    }
}

/// Which part the cycle feeds on, and why; `None` without a cycle.
fn describe_cause(found: &ChatterSummary) -> Option<String> {
    let number = |which| found.numbers.get(&which);
    let (part, speed) = (found.part.as_ref()?, format_digits(found.speed_m_per_s?, 3));
    let cycle = number(ChatterNumber::CycleFrequency)?.describe_value(" Hz");
    let natural = number(ChatterNumber::NaturalFrequency)?.describe_value(" Hz");
    let slope = number(ChatterNumber::FrictionSlope)?;
    let falls = ChatterEstimate { value: -slope.value, ..*slope }.describe_value(" per m/s");
    let why = match number(ChatterNumber::Feeding) {
        _ if slope.includes(0.0) => "whether friction falls with speed there is undecided".to_owned(),
        _ if slope.value >= 0.0 => "friction does not fall with speed there".to_owned(),
        None => format!(
            "friction falls there by {falls}, and the vibration grows even if friction does not change with speed"
        ),
        Some(feeding) => {
            let doubt =
                if feeding.includes(1.0) { "; whether it outweighs damping is undecided" } else { "" };
            let feeding = feeding.describe_value("");
            format!(
                "friction falls there by {falls}, which feeds the vibration {feeding} times as strongly as damping weakens it{doubt}"
            )
        }
    };
    Some(format!(
        "At {speed} m/s the cycle has {cycle} and feeds on the {part}, whose natural frequency of {natural} is nearest: {why}."
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_that_rounds_to_the_value_is_left_out() {
        let words = |value, half_95| ChatterEstimate { value, half_95 }.describe_value(" Hz");
        assert_eq!(words(519.0, Some(0.0)), "519 Hz");
        assert_eq!(words(519.0, Some(1e-9)), "519.000 Hz");
        assert_eq!(words(519.0, None), "519 Hz");
        assert_eq!(words(519.0, Some(2.0)), "519 Hz (517 to 521)");
    }
}
