//! The stability of a scene's blade or slider over speed and preload.

use super::changes::{ParameterChange, find_remedy, rank_changes};
use super::chatter::{ChatterCause, CycleRemedy};
use super::cycle_branch::CycleBranch;
use super::speed_intervals::{SpeedInterval, unstable_range};
use super::steady_sliding::{NoSliding, SlideFinder, SteadySlide};
use crate::model::Linkage;
use crate::simulate::drive::Drive;
use crate::simulate::scene::Scene;
use crate::simulate::scene::error::SceneError;
use std::f64::consts::TAU;

/// Name of the parameter that holds the preload of a scene's blade, or the normal force of its slider.
pub(super) fn preload_name(scene: &Scene) -> &'static str {
    if scene.linkage.is_slider() { "slider.normal_force_n" } else { "blade.preload_force_n" }
}

/// Speeds and preloads of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyRange {
    /// Lowest and highest speed of the head, m/s; 0 stands for the limit of slow sliding.
    pub speeds_m_per_s: [f64; 2],
    /// Lowest and highest preload, for a slider normal force, N; `None` for that of the scene alone.
    pub preloads_n: Option<[f64; 2]>,
    /// Number of speeds, and number of preloads of a range.
    pub points: usize,
}

/// Steady sliding at one speed and preload.
#[derive(Debug, Clone)]
pub struct StudyPoint {
    /// Speed of the head, m/s, negative for sliding towards -v.
    pub speed_m_per_s: f64,
    /// Preload, N.
    pub preload_n: f64,
    /// The equilibrium that the blade reaches, or why it reaches none.
    pub slide: Result<SteadySlide, NoSliding>,
    /// Equilibria with the neck on other sides of the shoulder.
    pub others: Vec<SteadySlide>,
}

/// Steady sliding in one direction with one preload.
#[derive(Debug, Clone)]
pub struct SlidingSurvey {
    /// Direction of sliding, +1 or -1.
    pub direction: f64,
    /// Preload, N.
    pub preload_n: f64,
    /// Intervals of speed.
    pub intervals: Vec<SpeedInterval>,
}

/// The stability of a blade or slider.
#[derive(Debug, Clone)]
pub struct StabilityStudy {
    /// Speeds and preloads.
    pub range: StudyRange,
    /// Preload of the scene, for a slider its normal force, N.
    pub preload_n: f64,
    /// Whether the blade has a shoulder.
    pub has_shoulder: bool,
    /// The blade with the scene's preload: towards +v, then towards -v if friction differs there.
    pub own: Vec<SlidingSurvey>,
    /// The blade with each preload of the range, in the directions of `own`; empty without a range of
    /// preloads.
    pub by_preload: Vec<SlidingSurvey>,
    /// All points, by direction, preload and speed.
    pub points: Vec<StudyPoint>,
    /// Effects of changes of the parameters on the instability at the scene's preload, the largest first.
    pub changes: Vec<ParameterChange>,
    /// The stick-slip cycle at the scene's preload, in the directions of `own` in which one is found.
    pub branches: Vec<CycleBranch>,
    /// The change after which the cycle ends at the lowest speed.
    pub remedy: Option<CycleRemedy>,
    /// Why the blade chatters; `None` if no cycle is found.
    pub cause: Option<ChatterCause>,
}

/// Twice the highest speed of the scene's drive, m/s: the top of the default range of speeds.
#[must_use]
pub fn default_top_speed(scene: &Scene) -> f64 {
    /// Number of intervals between the instants at which the speed of any drive but a cosine is read.
    const INSTANTS: u32 = 2000;
    let length_s = scene.run.stop_s - scene.start_s;
    let instants = (0..=INSTANTS).map(|i| scene.start_s + length_s * f64::from(i) / f64::from(INSTANTS));
    2.0 * match scene.drive {
        Drive::Cosine { amplitude_m, frequency_hz, .. } => TAU * frequency_hz * amplitude_m,
        _ => instants.map(|t| scene.drive.motion_at(t).velocity_m_per_s.abs()).fold(0.0, f64::max),
    }
}

impl StabilityStudy {
    /// Studies the blade of a scene.
    ///
    /// # Errors
    /// [`SceneError`] if the scene does not admit a preload of the range, or a parameter in its SI unit.
    pub fn from_scene(scene: &Scene, range: StudyRange) -> Result<Self, SceneError> {
        let preload = preload_name(scene);
        let own_n = scene.value(preload).unwrap_or(0.0);
        let directions: &[f64] =
            if scene.linkage.friction.backward_ratio == 1.0 { &[1.0] } else { &[1.0, -1.0] };
        let last = range.points.max(2) - 1;
        let spread = |[from, to]: [f64; 2], i: usize| {
            if i == last { to } else { from + (to - from) * i as f64 / last as f64 }
        };
        let blades: Vec<(f64, Linkage)> = match range.preloads_n {
            None => vec![(own_n, scene.linkage)],
            Some(ends) => (0..=last)
                .map(|i| {
                    let preload_n = spread(ends, i);
                    Ok((preload_n, scene.with_parameter(preload, preload_n)?.linkage))
                })
                .collect::<Result<_, SceneError>>()?,
        };
        let survey = |direction: f64, preload_n: f64, linkage: &Linkage| SlidingSurvey {
            direction,
            preload_n,
            intervals: SlideFinder::new(linkage, direction)
                .find_intervals(range.speeds_m_per_s, range.points),
        };
        let own: Vec<SlidingSurvey> =
            directions.iter().map(|&direction| survey(direction, own_n, &scene.linkage)).collect();
        let (mut points, mut by_preload) = (Vec::new(), Vec::new());
        for &direction in directions {
            for (preload_n, linkage) in &blades {
                if range.preloads_n.is_some() {
                    by_preload.push(survey(direction, *preload_n, linkage));
                }
                let mut finder = SlideFinder::new(linkage, direction);
                points.extend((0..=last).map(|i| {
                    let speed = spread(range.speeds_m_per_s, i);
                    let slide = finder.find_slide(speed);
                    let others = if slide.is_ok() { finder.find_other_slides(speed) } else { Vec::new() };
                    let speed_m_per_s = if speed == 0.0 { 0.0 } else { direction * speed };
                    StudyPoint { speed_m_per_s, preload_n: *preload_n, slide, others }
                }));
            }
        }
        let speeds = range.speeds_m_per_s;
        let branches: Vec<CycleBranch> = own
            .iter()
            .filter_map(|survey| {
                let unstable = unstable_range(&survey.intervals);
                CycleBranch::from_scene(scene, survey.direction, speeds, unstable)
            })
            .collect();
        let leading = leading_branch(&branches);
        let cycle = leading.filter(|branch| branch.fold_m_per_s().is_some());
        let changes = rank_changes(scene, &own, cycle, speeds)?;
        let remedy = cycle.and_then(|cycle| find_remedy(scene, &changes, cycle, speeds));
        let cause = leading.and_then(|branch| {
            let survey = own.iter().find(|survey| survey.direction == branch.direction)?;
            ChatterCause::from_branch(&scene.linkage, branch, unstable_range(&survey.intervals))
        });
        let has_shoulder = scene.linkage.shoulder.is_some();
        let preload_n = own_n;
        Ok(Self { range, preload_n, has_shoulder, own, by_preload, points, changes, branches, remedy, cause })
    }

    /// The cycle that goes on to the highest speed, of those in both directions.
    #[must_use]
    pub fn leading_branch(&self) -> Option<&CycleBranch> {
        leading_branch(&self.branches)
    }

    /// The direction of the leading branch or, without a cycle, that in which the instability ends at the
    /// higher speed.
    pub(super) fn leading_direction(&self) -> f64 {
        let end = |survey: &&SlidingSurvey| unstable_range(&survey.intervals).map_or(-1.0, |[_, end]| end);
        let unstable =
            || self.own.iter().max_by(|a, b| end(a).total_cmp(&end(b))).map(|survey| survey.direction);
        self.leading_branch().map(|branch| branch.direction).or_else(unstable).unwrap_or(1.0)
    }

    /// The lowest and the highest speed, m/s, at which steady sliding of the scene's blade is unstable in
    /// any direction.
    #[must_use]
    pub fn unstable_range(&self) -> Option<[f64; 2]> {
        let ranges = self.own.iter().filter_map(|survey| unstable_range(&survey.intervals));
        ranges.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// Why the blade cannot slide steadily at the first point; `None` if it can at any point of the study.
    #[must_use]
    pub fn why_impossible(&self) -> Option<NoSliding> {
        let mut reasons = self.points.iter().map(|point| point.slide.as_ref().err().copied());
        let first = reasons.next()?;
        if reasons.all(|reason| reason.is_some()) { first } else { None }
    }
}

fn leading_branch(branches: &[CycleBranch]) -> Option<&CycleBranch> {
    branches.iter().max_by(|a, b| a.end_m_per_s.total_cmp(&b.end_m_per_s))
}
