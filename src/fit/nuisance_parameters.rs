//! Constants of the scenes that a trace fit frees within priors, and a check of the common scale of masses
//! and forces, which the motion does not determine.

use super::job::{Constants, FreeParameter, Job, NuisanceParameter, is_same_quantity};
use crate::model::parameters::{ModelParameter, ParameterQuantity, ParameterRange, find_parameter};
use crate::simulate::scene::Scene;
use portable_math as math;

/// Half width of the range of a freed constant, in standard deviations of its prior.
const RANGE_SD: f64 = 5.0;

/// A constant that is freed, with its prior.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FreedConstant {
    /// Key of the constant in the scene file, preceded by its table.
    pub name: String,
    /// Value in the scene, in its SI unit.
    pub value: f64,
    /// Standard deviation of the prior of the constant's natural logarithm.
    pub sd_relative: f64,
}

impl FreedConstant {
    /// Lowest and highest value that the constant may have, in its SI unit.
    pub(crate) fn range(&self) -> [f64; 2] {
        let factor = math::exp(RANGE_SD * self.sd_relative);
        let [low, high] = [self.value / factor, self.value * factor];
        match find_parameter(&self.name).map(|parameter| parameter.range) {
            Some(ParameterRange::Within(least, most)) => [low.max(least), high.min(most)],
            _ => [low, high],
        }
    }
}

/// Error: constants or parameters cannot be freed as the job requires. The text says what was found, what was
/// expected, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct NuisanceError(String);

/// Constants that a job frees, in the order of the job's list. Without a list, they are in the order of their
/// names.
///
/// # Errors
/// [`NuisanceError`] for a listed constant that a scene does not have, or whose values differ between scenes.
pub(crate) fn free_constants(job: &Job, scenes: &[Scene]) -> Result<Vec<FreedConstant>, NuisanceError> {
    match &job.constants {
        Constants::Exact => Ok(Vec::new()),
        Constants::Listed(list) => list.iter().map(|one| free_listed_constant(one, job, scenes)).collect(),
        Constants::All { sd_relative } => {
            let few_percent = |parameter: &ModelParameter| is_constant(parameter).then_some(*sd_relative);
            Ok(free_all_constants(few_percent, job, scenes))
        }
        Constants::Default => Ok(free_all_constants(default_prior_sd, job, scenes)),
    }
}

fn free_listed_constant(
    wanted: &NuisanceParameter,
    job: &Job,
    scenes: &[Scene],
) -> Result<FreedConstant, NuisanceError> {
    let NuisanceParameter { name, sd_relative } = wanted;
    let mut first: Option<(f64, &str)> = None;
    for (scene, condition) in scenes.iter().zip(&job.conditions) {
        let found = scene.value(name);
        let Some(value) = found.filter(|value| *value > 0.0) else {
            let found = found.map_or("nothing".to_owned(), |value| value.to_string());
            return Err(NuisanceError(format!(
                "nuisance `{name}`: found {found} in the scene of `{}`, expected a number above 0, because its prior is one of its logarithm; remove it",
                condition.name
            )));
        };
        let (before, one) = *first.get_or_insert((value, &condition.name));
        if before.to_bits() != value.to_bits() {
            return Err(NuisanceError(format!(
                "nuisance `{name}`: found {before} in the scene of `{one}` and {value} in that of `{}`, expected one value for all; correct a scene, or remove it",
                condition.name
            )));
        }
    }
    let value = first.map_or(0.0, |(value, _)| value);
    Ok(FreedConstant { name: name.clone(), value, sd_relative: *sd_relative })
}

/// All constants for which `prior_sd` gives a standard deviation and that have the same value in all scenes,
/// with the names that the first scene uses.
fn free_all_constants(
    prior_sd: impl Fn(&ModelParameter) -> Option<f64>,
    job: &Job,
    scenes: &[Scene],
) -> Vec<FreedConstant> {
    let Some((scene, others)) = scenes.split_first() else { return Vec::new() };
    let is_set = |name: &str| {
        job.conditions.iter().flat_map(|c| &c.set).any(|(set, _)| is_same_quantity(set, name))
            || find_free_parameter(job, name).is_some()
    };
    let freed = |(name, value): (&str, f64)| {
        let sd_relative = find_parameter(name).and_then(&prior_sd)?;
        let usable = value > 0.0 && !is_set(name);
        let same = others.iter().all(|other| other.value(name) == Some(value));
        (usable && same).then(|| FreedConstant { name: name.to_owned(), value, sd_relative })
    };
    scene.written_values().filter_map(freed).collect()
}

/// Default standard deviation of the prior of the natural logarithm of a constant. It states how well the
/// constant of a real blade is known from a balance, a picture of the section, or a similar blade. `None` for
/// a quantity that is not a constant of a blade or slider.
///
/// The default priors apply to a job with traces and without `nuisance`.
pub(crate) fn default_prior_sd(parameter: &ModelParameter) -> Option<f64> {
    use ParameterQuantity as Q;
    /// Masses and forces are weighed. A balance is accurate to a percent, but a piece that is cut from the
    /// blade does not end exactly where a link of the model ends.
    const WEIGHED: f64 = 0.05;
    /// Inertias and centres of mass are computed from the contour of the section, with a uniform density.
    const COMPUTED: f64 = 0.1;
    /// Lengths between hinges are read off a picture of the section, with an error of 0.1 mm in 5 mm.
    const READ: f64 = 0.02;
    /// The natural frequency of the lip is heard or filmed on the free blade.
    const HEARD: f64 = 0.05;
    /// Natural frequencies and the angle of the shoulder are known from a blade of the same kind.
    const SIMILAR: f64 = 0.1;
    /// The damping of rubber varies with its age and temperature, by a factor of 1.5; the value is ln 1.5.
    /// The damping of a slider has the same prior.
    const DAMPING: f64 = 0.405;
    /// Mass and normal force of a slider are weighed. Nothing is cut, so only the error of the balance
    /// counts.
    const WEIGHED_WHOLE: f64 = 0.01;
    /// The stiffness of a slider's spring is measured as force divided by displacement.
    const PULLED: f64 = 0.05;
    let frequency_sd = match parameter.quantity {
        Q::SliderMass | Q::NormalForce => return Some(WEIGHED_WHOLE),
        Q::SliderStiffness => return Some(PULLED),
        Q::HeadMass | Q::NeckMass | Q::LipMass | Q::Preload => return Some(WEIGHED),
        Q::NeckInertia | Q::LipInertia | Q::NeckCentre | Q::LipCentre => return Some(COMPUTED),
        Q::NeckLength | Q::LipLength => return Some(READ),
        Q::HeadDamping | Q::NeckDamping | Q::LipDamping | Q::ShoulderDamping | Q::SliderDamping => {
            return Some(DAMPING);
        }
        Q::ShoulderAngle => return Some(SIMILAR),
        Q::LipStiffness => HEARD,
        Q::HeadStiffness | Q::NeckStiffness | Q::ShoulderStiffness => SIMILAR,
        _ => return None, // friction, drive and restitution
    };
    // a stiffness varies with the square of the frequency
    Some(if parameter.unit == "Hz" { frequency_sd } else { 2.0 * frequency_sd })
}

/// Whether a job with one percentage for all constants frees this parameter. Lengths and centres of mass then
/// count as exact, friction is estimated as a parameter, and drive and restitution belong to the experiment.
fn is_constant(parameter: &ModelParameter) -> bool {
    use ParameterQuantity as Q;
    let exact = [Q::NeckLength, Q::LipLength, Q::NeckCentre, Q::LipCentre, Q::Restitution];
    let is_sought = ["friction.", "drive."].iter().any(|table| parameter.name.starts_with(table));
    !exact.contains(&parameter.quantity) && !is_sought
}

/// Refuses a job in which all parameters whose unit contains a mass are free and have no prior.
///
/// # Errors
/// [`NuisanceError`] with the names of the parameters.
pub(crate) fn check_scaling(job: &Job, scenes: &[Scene]) -> Result<(), NuisanceError> {
    // the common scale of masses and forces is determined if any parameter whose unit contains a mass is
    // fixed or has a prior
    let is_held = |(name, _): (&str, f64)| match find_free_parameter(job, name) {
        // the form in which the job writes the parameter decides: a stiffness that is written as a frequency
        // has no unit of mass
        Some(free) => has_mass(&free.name) && free.prior.is_some(),
        None => has_mass(name),
    };
    let all_loose = |scene: &Scene| !scene.written_values().filter(|(_, value)| *value != 0.0).any(is_held);
    if !scenes.iter().any(all_loose) {
        return Ok(());
    }
    let heavy = job.parameters.iter().filter(|free| has_mass(&free.name));
    let names = heavy.map(|free| format!("`{}`", free.name)).collect::<Vec<_>>().join(", ");
    Err(NuisanceError(format!(
        "parameters: everything of the scene that has a unit of mass or force is free and without a prior ({names}): multiplied by one factor, masses, inertias, stiffnesses, dampings and preload give the same motion, so no recording tells their size; give one of them a `prior`, or leave one out"
    )))
}

/// The free parameter that is the same quantity as `name`, even if the job writes it in another form.
fn find_free_parameter<'a>(job: &'a Job, name: &str) -> Option<&'a FreeParameter> {
    job.parameters.iter().find(|free| is_same_quantity(&free.name, name))
}

/// Whether the unit of a parameter contains a mass, as kg and N do.
fn has_mass(name: &str) -> bool {
    find_parameter(name)
        .is_some_and(|parameter| parameter.unit.starts_with("kg") || parameter.unit.starts_with('N'))
}
