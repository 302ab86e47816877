//! What a change of the blade or slider does to the speeds at which steady sliding is unstable.

use super::chatter::CycleRemedy;
use super::cycle_branch::CycleBranch;
use super::journal::{EvaluationLog, StudyStop};
use super::speed_intervals::{SlidingState, unstable_range};
use super::steady_sliding::SlideFinder;
use super::study::SlidingSurvey;
use crate::model::Linkage;
use crate::model::parameters::{ModelParameter, PARAMETERS, damping_from_ratio};
use crate::simulate::scene::Scene;
use crate::simulate::scene::error::SceneError;

/// Masses, stiffnesses, dampings, the preload and the angle of the shoulder, in SI units, and the numbers of
/// the friction law. Each changes alone, while all other parameters keep their values.
fn changed_parameters() -> impl Iterator<Item = &'static ModelParameter> {
    /// Parts of the names of parameters that are left out: lengths and inertias, and other forms of the
    /// parameters that are changed.
    const OTHERS: [&str; 6] =
        ["length", "centre", "inertia", "frequency", "damping_ratio", "stiffness_ratio"];
    PARAMETERS.iter().filter(|parameter| match parameter.name.split_once('.') {
        Some(("friction", _)) => true,
        Some(("blade" | "shoulder" | "slider", key)) => {
            key != "preload_displacement_m" && !OTHERS.iter().any(|part| key.contains(part))
        }
        _ => false,
    })
}

/// Step of a change, as a fraction of the value.
const SHARE: f64 = 0.01;
/// Step of a damping that is zero, as a damping ratio.
const DAMPING_STEP: f64 = 1e-3;

/// An effect below this fraction of the highest speed of the range is an error of the bisection.
const LEAST_EFFECT: f64 = 1e-8;
/// An effect on the end of the cycle below this fraction of the highest speed is an error of the branch.
const LEAST_FOLD: f64 = 1e-5;

/// Effect of a change of one parameter.
#[derive(Debug, Clone, Copy)]
pub struct ParameterChange {
    /// The parameter.
    pub parameter: &'static ModelParameter,
    /// Its value, in its SI unit.
    pub value: f64,
    /// The change, in the same unit: 1 % of the value. For a damping of zero it is the damping that gives a
    /// damping ratio of 0.001.
    pub step: f64,
    /// Change of the lowest speed at which steady sliding is unstable, m/s per step. `None` if this speed is
    /// the lowest of the range, or if it is not found for the changed blade.
    pub onset_m_per_s: Option<f64>,
    /// Change of the highest speed at which steady sliding is unstable, m/s per step. `None` if this speed is
    /// the highest of the range, or if it is not found for the changed blade.
    pub end_m_per_s: Option<f64>,
    /// Change of the speed at which the stick-slip cycle ends, m/s per step. `None` if this speed is not
    /// found, for the scene or for the changed one.
    pub fold_m_per_s: Option<f64>,
}

impl ParameterChange {
    fn size(&self) -> f64 {
        [self.onset_m_per_s, self.end_m_per_s, self.fold_m_per_s]
            .into_iter()
            .flatten()
            .map(f64::abs)
            .fold(0.0, f64::max)
    }
}

/// The scene with masses, stiffnesses, dampings, preload and shoulder angle in SI units. A stiffness that is
/// given as a natural frequency, for example, would change with a mass.
///
/// # Errors
/// As [`Scene::with_parameter`].
pub fn write_in_physical_units(scene: &Scene) -> Result<Scene, SceneError> {
    let convert = |converted: Scene, parameter: &ModelParameter| match scene.value(parameter.name) {
        Some(value) => converted.with_parameter(parameter.name, value),
        None => Ok(converted),
    };
    changed_parameters().try_fold(scene.clone(), convert)
}

/// Effects of all parameters on the unstable range and on the end of the cycle, the largest first; parameters
/// without effect are left out. If friction differs between the directions, the range is that of the
/// direction with the higher end. `cycle` is a branch whose end is found.
pub(super) fn rank_changes(
    scene: &Scene,
    own: &[SlidingSurvey],
    cycle: Option<&CycleBranch>,
    speeds_m_per_s: [f64; 2],
    log: &mut EvaluationLog<'_>,
) -> Result<Vec<ParameterChange>, StudyStop> {
    let ranges = own.iter().filter_map(|survey| Some((survey.direction, unstable_range(&survey.intervals)?)));
    let range = ranges.max_by(|a, b| a.1[1].total_cmp(&b.1[1]));
    let [lowest, highest] = speeds_m_per_s;
    let boundaries = range.map(|(direction, [onset, end])| {
        [(onset, 1.0, onset > lowest), (end, -1.0, end < highest)].map(|boundary| (direction, boundary))
    });
    let physical = write_in_physical_units(scene)?;
    let mut changes = Vec::new();
    for parameter in changed_parameters() {
        let name = parameter.name;
        let Some(value) = physical.value(name) else { continue };
        let Some(step) = change_step(&physical, name, value) else { continue };
        let change = |(direction, (speed, inwards, is_found)): (f64, (f64, f64, bool))| {
            let find = |linkage: &Linkage| find_boundary(linkage, direction, speed, inwards);
            is_found
                .then(|| number_change(&physical, name, [value, step], speed, |scene| find(&scene.linkage)))?
        };
        let compute = || {
            let [onset, end] = boundaries.map_or([None; 2], |both| both.map(change));
            let fold = cycle.and_then(|cycle| {
                let find = |scene: &Scene| cycle.find_changed_end(scene);
                number_change(&physical, name, [value, step], cycle.end_m_per_s, find)
            });
            [onset, end, fold.map(|moved| if moved.abs() > LEAST_FOLD * highest { moved } else { 0.0 })]
        };
        let [onset_m_per_s, end_m_per_s, fold_m_per_s] =
            log.evaluate(format!("change of {name}"), compute)?;
        changes.push(ParameterChange { parameter, value, step, onset_m_per_s, end_m_per_s, fold_m_per_s });
    }
    changes.retain(|change| change.size() > LEAST_EFFECT * highest);
    portable_math::sort_by_number(&mut changes, |a| -a.size());
    Ok(changes)
}

/// The change of one parameter after which the cycle ends at the lowest speed. A damping is doubled or
/// halved; any other parameter is multiplied or divided by 1.2. The derivatives select three changes, and the
/// cycle is computed for each of them. `None` if none of them lowers the speed.
pub(super) fn find_remedy(
    scene: &Scene,
    changes: &[ParameterChange],
    cycle: &CycleBranch,
    speeds_m_per_s: [f64; 2],
    log: &mut EvaluationLog<'_>,
) -> Result<Option<CycleRemedy>, StudyStop> {
    const CANDIDATES: usize = 3;
    const FIFTH: f64 = 1.2;
    let physical = write_in_physical_units(scene)?;
    let own = changes.iter().filter(|change| !change.parameter.name.starts_with("friction."));
    let mut guesses: Vec<(f64, &ParameterChange, f64)> = own
        .filter_map(|change| {
            let slope = change.fold_m_per_s?;
            let is_damping = change.parameter.name.contains("damping");
            let factor = match (is_damping, slope > 0.0) {
                (true, true) => 0.5,
                (true, false) => 2.0,
                (false, true) => 1.0 / FIFTH,
                (false, false) => FIFTH,
            };
            Some((slope * change.value * (factor - 1.0) / change.step, change, factor))
        })
        .filter(|(moved, ..)| *moved < 0.0)
        .collect();
    portable_math::sort_by_number(&mut guesses, |a| a.0);
    let compute = |change: &ParameterChange, factor: f64| {
        let changed = physical.with_parameter(change.parameter.name, factor * change.value).ok()?;
        let intervals =
            SlideFinder::new(&changed.linkage, cycle.direction).find_intervals(speeds_m_per_s, 100);
        let unstable = unstable_range(&intervals);
        let branch = CycleBranch::from_scene(&changed, cycle.direction, speeds_m_per_s, unstable);
        let cycle_fold_m_per_s = match (branch, unstable) {
            (Some(branch), _) => Some(branch.fold_m_per_s()?),
            (None, None) => None,
            (None, Some(_)) => return None,
        };
        let parameter = change.parameter.name.to_owned();
        Some(CycleRemedy { parameter, factor, cycle_fold_m_per_s })
    };
    let mut computed: Vec<CycleRemedy> = Vec::new();
    for (_, change, factor) in guesses.into_iter().take(CANDIDATES) {
        let name = format!("{factor} times {}", change.parameter.name);
        computed.extend(log.evaluate(name, || compute(change, factor))?);
    }
    let speed = |remedy: &CycleRemedy| remedy.cycle_fold_m_per_s.unwrap_or(0.0);
    let best = computed.into_iter().min_by(|a, b| speed(a).total_cmp(&speed(b)));
    Ok(best.filter(|best| speed(best) < cycle.end_m_per_s))
}

/// The step of a parameter; `None` if its value is zero and it is not a damping.
fn change_step(scene: &Scene, name: &str, value: f64) -> Option<f64> {
    if value != 0.0 {
        return Some(SHARE * value);
    }
    if let Some(slider) = scene.linkage.slider().filter(|_| name == "slider.damping_n_s_per_m") {
        let stiffness = slider.spring.stiffness;
        return Some(damping_from_ratio(DAMPING_STEP, stiffness, slider.mass_kg)).filter(|step| *step > 0.0);
    }
    let part = name.split_once("_damping_").or_else(|| name.split_once(".damping_"))?.0;
    let ratio = if part == "shoulder" { "shoulder.damping_ratio" } else { &format!("{part}_damping_ratio") };
    scene.with_parameter(ratio, DAMPING_STEP).ok()?.value(name)
}

/// Change of a number, such as a speed, that `find` computes, per step of a parameter: a central difference
/// over a fraction of the step. `None` if the number is not found for the changed blade.
pub(super) fn number_change(
    scene: &Scene,
    name: &str,
    [value, step]: [f64; 2],
    own: f64,
    find: impl Fn(&Scene) -> Option<f64>,
) -> Option<f64> {
    /// Fraction of the step. With steps of 1 % the parameter changes by 1e-3 of its value, and the relative
    /// error of a central difference is about the square of that.
    const FRACTION: f64 = 0.1;
    let find = |factor: f64| find(&scene.with_parameter(name, value + factor * step).ok()?);
    // a parameter at the lower limit of its range cannot fall; the difference is then one-sided
    let (ahead, behind) = (find(FRACTION)?, find(-FRACTION));
    let (before, width) = behind.map_or((own, FRACTION), |behind| (behind, 2.0 * FRACTION));
    Some((ahead - before) / width)
}

/// The boundary of the unstable range near a speed, m/s; `None` if there is none within a third of this
/// speed.
pub(super) fn find_boundary(linkage: &Linkage, direction: f64, speed: f64, inwards: f64) -> Option<f64> {
    let mut finder = SlideFinder::new(linkage, direction);
    let mut width = 0.01;
    while width < 0.5 {
        let [inside, outside] = [speed * (1.0 + inwards * width), speed * (1.0 - inwards * width)];
        let [state, beyond] = [inside, outside].map(|at| finder.sliding_state(at));
        if state == SlidingState::Unstable && beyond != SlidingState::Unstable {
            return Some(finder.bisect_state(state, [inside, outside]).0[0]);
        }
        width *= 2.0;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::study::{StabilityStudy, StudyRange};

    fn study(scene: &Scene) -> StabilityStudy {
        let range = StudyRange { speeds_m_per_s: [0.0, 1.0], preloads_n: None, points: 40 };
        StabilityStudy::from_scene(scene, range, &mut EvaluationLog::without_journal()).unwrap()
    }

    /// If a parameter of the scene changes by 0.02 of its step, the end of the instability moves as computed.
    /// If it changes by 0.5 of its step, so does the end of the cycle; only a few parameters are tried. The
    /// differences use 0.1 of a step, so these changes also check their error.
    #[test]
    fn the_ends_of_a_changed_blade_move_as_computed() {
        const PART: f64 = 0.02;
        const PART_OF_CYCLE: f64 = 0.5;
        let mut cycles = 0;
        for text in [
            include_str!("../../data/scenes/actual-blade.toml"),
            include_str!("../../data/scenes/light-blade.toml"),
        ] {
            let scene = Scene::parse("s", text).unwrap();
            let own = study(&scene);
            let [_, end] = own.unstable_range().unwrap();
            let fold = own.leading_branch().unwrap().fold_m_per_s().unwrap();
            assert!(own.changes.len() >= 12, "{}", own.changes.len());
            let physical = write_in_physical_units(&scene).unwrap();
            let unstable = |scene: &Scene| {
                unstable_range(&SlideFinder::new(&scene.linkage, 1.0).find_intervals([0.0, 1.0], 40))
            };
            for change in &own.changes {
                let name = change.parameter.name;
                let changed = physical.with_parameter(name, change.value + PART * change.step).unwrap();
                let moved = (unstable(&changed).unwrap()[1] - end) / PART;
                let stated = change.end_m_per_s.unwrap();
                let allowed = 0.01 * stated.abs() + 1e-8;
                assert!((moved - stated).abs() < allowed, "{name}: {moved:e} m/s, stated {stated:e} m/s");
            }
            for change in own.changes.iter().filter(|change| change.value != 0.0).take(2) {
                let name = change.parameter.name;
                let value = change.value + PART_OF_CYCLE * change.step;
                let changed = physical.with_parameter(name, value).unwrap();
                let branch = CycleBranch::from_scene(&changed, 1.0, [0.0, 1.0], unstable(&changed)).unwrap();
                let moved = (branch.fold_m_per_s().unwrap() - fold) / PART_OF_CYCLE;
                let stated = change.fold_m_per_s.unwrap();
                let allowed = 0.02 * stated.abs();
                assert!((moved - stated).abs() < allowed, "{name}: {moved:e} m/s, stated {stated:e} m/s");
                cycles += 1;
            }
        }
        assert_eq!(cycles, 4);
    }

    /// The step of a damping of zero is a damping ratio of 0.001, and it lowers the end of the instability.
    #[test]
    fn the_effect_of_a_damping_of_zero_is_computed() {
        let text = include_str!("../../data/scenes/light-blade.toml");
        let scene = Scene::parse("s", text).unwrap().with_parameter("blade.neck_damping_ratio", 0.0).unwrap();
        let changes = study(&scene).changes;
        let neck = changes.iter().find(|c| c.parameter.name == "blade.neck_damping_n_m_s_per_rad").unwrap();
        let ratio = scene.with_parameter("blade.neck_damping_n_m_s_per_rad", neck.step).unwrap();
        assert_eq!(neck.value, 0.0);
        assert!((ratio.value("blade.neck_damping_ratio").unwrap() - DAMPING_STEP).abs() < 1e-12);
        assert!(neck.end_m_per_s.unwrap() < 0.0, "{neck:?}");
    }
}
