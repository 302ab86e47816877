//! The stability of a scene's blade or slider over speed and preload.

use super::changes::{ParameterChange, find_remedy, rank_changes};
use super::chatter::{ChatterCause, CycleRemedy};
use super::cycle_branch::CycleBranch;
use super::journal::{EvaluationLog, StudyStop};
use super::speed_intervals::{SpeedInterval, spread_values, unstable_range};
use super::steady_sliding::{NoSliding, SlideFinder, SteadySlide};
use crate::model::Linkage;
use crate::simulate::drive::Drive;
use crate::simulate::scene::Scene;
use crate::simulate::scene::error::SceneError;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Name of the parameter that holds the preload of a scene's blade, or the normal force of its slider.
pub(super) fn preload_name(scene: &Scene) -> &'static str {
    if scene.linkage.is_slider() { "slider.normal_force_n" } else { "blade.preload_force_n" }
}

/// Speeds and preloads of a study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StudyRange {
    /// Lowest and highest speed of the head, m/s; 0 stands for the limit of slow sliding.
    pub speeds_m_per_s: [f64; 2],
    /// Lowest and highest preload, for a slider normal force, N; `None` for that of the scene alone.
    pub preloads_n: Option<[f64; 2]>,
    /// Number of speeds, and number of preloads of a range.
    pub points: usize,
}

/// Steady sliding at one speed.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct StudyPoint {
    /// Speed of the head, m/s, without sign.
    pub speed_m_per_s: f64,
    /// The equilibrium that the blade reaches, or why it reaches none.
    pub slide: Result<SteadySlide, NoSliding>,
    /// Equilibria with the neck on other sides of the shoulder.
    pub others: Vec<SteadySlide>,
}

/// Steady sliding in one direction with one preload.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SlidingSurvey {
    /// Direction of sliding, +1 or -1.
    pub direction: f64,
    /// Preload, N.
    pub preload_n: f64,
    /// Intervals of speed.
    pub intervals: Vec<SpeedInterval>,
    /// Steady sliding at equally spaced speeds.
    pub points: Vec<StudyPoint>,
}

impl SlidingSurvey {
    fn from_linkage(linkage: &Linkage, direction: f64, preload_n: f64, range: &StudyRange) -> Self {
        let mut finder = SlideFinder::new(linkage, direction);
        let point = |speed_m_per_s: f64| {
            let slide = finder.find_slide(speed_m_per_s);
            let others = if slide.is_ok() { finder.find_other_slides(speed_m_per_s) } else { Vec::new() };
            StudyPoint { speed_m_per_s, slide, others }
        };
        let points: Vec<StudyPoint> = spread_values(range.speeds_m_per_s, range.points).map(point).collect();
        let slides = points.iter().map(|point| (point.speed_m_per_s, point.slide.as_ref()));
        let intervals = finder.divide_range(slides);
        Self { direction, preload_n, intervals, points }
    }
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
    const INSTANTS: usize = 2000;
    let instants = spread_values([scene.start_s, scene.run.stop_s], INSTANTS + 1);
    2.0 * match scene.drive {
        Drive::Cosine { amplitude_m, frequency_hz, .. } => TAU * frequency_hz * amplitude_m,
        _ => instants.map(|t| scene.drive.motion_at(t).velocity_m_per_s.abs()).fold(0.0, f64::max),
    }
}

impl StabilityStudy {
    /// Studies the blade of a scene. `log` holds the finished evaluations.
    ///
    /// # Errors
    /// [`StudyStop`] if the scene does not admit a preload of the range, or a parameter in its SI unit, or if
    /// the log stops the study.
    pub fn from_scene(
        scene: &Scene,
        range: StudyRange,
        log: &mut EvaluationLog<'_>,
    ) -> Result<Self, StudyStop> {
        let preload = preload_name(scene);
        let preload_n = scene.value(preload).unwrap_or(0.0);
        let directions: &[f64] =
            if scene.linkage.friction.backward_ratio == 1.0 { &[1.0] } else { &[1.0, -1.0] };
        let preloads = range.preloads_n.map(|ends| spread_values(ends, range.points));
        let blade = |preload_n| Ok((preload_n, scene.with_parameter(preload, preload_n)?.linkage));
        let blades = preloads.into_iter().flatten().map(blade).collect::<Result<Vec<_>, SceneError>>()?;
        let mut survey = |name: &str, direction: f64, preload_n: f64, linkage: &Linkage| {
            let compute = || SlidingSurvey::from_linkage(linkage, direction, preload_n, &range);
            log.evaluate(format!("{name} {direction}"), compute)
        };
        let (mut own, mut by_preload) = (Vec::new(), Vec::new());
        for &direction in directions {
            own.push(survey("sliding", direction, preload_n, &scene.linkage)?);
            for (row, (preload_n, linkage)) in blades.iter().enumerate() {
                by_preload.push(survey(&format!("row {row}"), direction, *preload_n, linkage)?);
            }
        }
        let speeds = range.speeds_m_per_s;
        let mut branches = Vec::new();
        for SlidingSurvey { direction, intervals, .. } in &own {
            let compute = || CycleBranch::from_scene(scene, *direction, speeds, unstable_range(intervals));
            branches.extend(log.evaluate(format!("cycle {direction}"), compute)?);
        }
        let leading = leading_branch(&branches);
        let cycle = leading.filter(|branch| branch.fold_m_per_s().is_some());
        let changes = rank_changes(scene, &own, cycle, speeds, log)?;
        let remedy = match cycle {
            // a remedy may end the cycle below the range
            Some(cycle) => find_remedy(scene, &changes, cycle, [0.0, speeds[1]], log)?,
            None => None,
        };
        let cause = leading.and_then(|branch| {
            let survey = own.iter().find(|survey| survey.direction == branch.direction)?;
            ChatterCause::from_branch(scene, branch, unstable_range(&survey.intervals))
        });
        let has_shoulder = scene.linkage.shoulder.is_some();
        Ok(Self { range, preload_n, has_shoulder, own, by_preload, changes, branches, remedy, cause })
    }

    /// The surveys whose points are tabulated: those of the range of preloads, or those of the scene.
    #[must_use]
    pub fn surveys(&self) -> &[SlidingSurvey] {
        if self.by_preload.is_empty() { &self.own } else { &self.by_preload }
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
        let mut points = self.surveys().iter().flat_map(|survey| &survey.points);
        let first = points.next()?.slide.as_ref().err().copied();
        if points.all(|point| point.slide.is_err()) { first } else { None }
    }
}

fn leading_branch(branches: &[CycleBranch]) -> Option<&CycleBranch> {
    branches.iter().max_by(|a, b| a.end_m_per_s.total_cmp(&b.end_m_per_s))
}
