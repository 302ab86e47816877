//! The stick-slip cycle of a blade or slider over the speed of its head, and the speed at which it ends.
//!
//! A cycle is followed along its branch, in steps of arc length, through folds. The branch turns back to
//! lower speeds at a fold, where a multiplier is 1, or at a corner, where the cycle loses its stick: there it
//! meets a motion without stick. Above this speed chatter does not go on.

use super::shooting::{CycleShooter, PeriodicMotion, Solution, Unknowns, by_speed};
use super::speed_intervals::unstable_range;
use super::steady_sliding::{SlideFinder, SteadySlide};
use crate::model::{LinkDirections, Linkage, Pose};
use crate::simulate::scene::Scene;
use serde::{Deserialize, Serialize};

/// How a stick-slip cycle ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CycleEnd {
    /// A fold: a stable and an unstable cycle meet, and a multiplier is 1.
    Fold,
    /// A corner of the branch: the stick of the cycle shrinks to an instant.
    StickLost,
    /// Above the last cycle the tip slows down but does not stop: a stick of finite length is
    /// lost at once.
    Grazing,
    /// The cycle goes on at the highest speed of the range.
    EndOfRange,
    /// The branch could not be followed further.
    Undecided,
}

impl CycleEnd {
    /// Whether the branch turns back at the end.
    fn is_turn(self) -> bool {
        !matches!(self, Self::EndOfRange | Self::Undecided)
    }
}

/// The cycle over speed, in one direction.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CycleBranch {
    /// Direction of sliding, +1 or -1.
    pub direction: f64,
    /// The motions along the branch: from low speeds to the end of the cycle, then the motions beyond it.
    pub motions: Vec<PeriodicMotion>,
    /// Number of the motions up to the end of the cycle.
    pub before_end: usize,
    /// How the cycle ends.
    pub end: CycleEnd,
    /// The speed at which the cycle ends, m/s, or the highest speed at which it was found.
    pub end_m_per_s: f64,
    /// Why the branch could not be followed; empty for other ends.
    pub problem: String,
}

impl CycleBranch {
    /// The speed at which the cycle ends, m/s; `None` if no end was found.
    #[must_use]
    pub fn fold_m_per_s(&self) -> Option<f64> {
        self.end.is_turn().then_some(self.end_m_per_s)
    }

    /// The cycle just below its end. The last motions are so close to the end that their multipliers and
    /// sticks may belong to the other side of it.
    fn cycle_below_end(&self) -> Option<&PeriodicMotion> {
        let below = |cycle: &&PeriodicMotion| cycle.speed_m_per_s < 0.999 * self.end_m_per_s;
        self.cycles().iter().rev().find(below)
    }

    /// The cycle of the branch whose speed is nearest to a speed, m/s.
    pub(super) fn nearest_cycle(&self, speed_m_per_s: f64) -> Option<&PeriodicMotion> {
        let away = |cycle: &&PeriodicMotion| (cycle.speed_m_per_s - speed_m_per_s).abs();
        self.cycles().iter().min_by(|a, b| away(a).total_cmp(&away(b)))
    }

    /// Whether the cycle just below its end is stable.
    #[must_use]
    pub fn is_stable_below_end(&self) -> bool {
        self.cycle_below_end().is_some_and(PeriodicMotion::is_stable)
    }

    /// Whether the cycle just below its end sticks. If it does not, it has lost its stick at a lower speed
    /// and goes on as a vibration without stick.
    #[must_use]
    pub fn sticks_below_end(&self) -> bool {
        self.cycle_below_end().is_some_and(|cycle| !cycle.sticks_s.is_empty())
    }

    /// The cycles up to the end.
    #[must_use]
    pub fn cycles(&self) -> &[PeriodicMotion] {
        &self.motions[..self.before_end]
    }

    /// Finds the cycle of a scene and follows it over a range of speed, m/s. `unstable` are the lowest and
    /// the highest speed at which steady sliding is unstable. `None` if no cycle is found.
    #[must_use]
    pub fn from_scene(
        scene: &Scene,
        direction: f64,
        range: [f64; 2],
        unstable: Option<[f64; 2]>,
    ) -> Option<Self> {
        /// Speeds of the runs, as fractions of the range up to the speed at which the instability ends, or up
        /// to the highest speed.
        const SHARES: [f64; 7] = [0.9, 0.6, 0.3, 0.1, 0.03, 0.01, 0.003];
        let top = unstable.map_or(range[1], |[_, end]| end);
        let settled = SHARES.iter().find_map(|share| {
            let speed = range[0] + share * (top - range[0]);
            let mut walker = BranchWalker::new(scene, direction, range, speed)?;
            let slide = walker.finder.find_slide(speed).ok()?;
            let stopped = stop_tip(&scene.linkage, &slide, direction * speed);
            let start = walker.shooter.settle(stopped, speed).ok()?;
            Some(walker.follow_cycle(start, direction))
        });
        // a run does not settle if a slower vibration makes its cycles unequal
        settled.or_else(|| unstable.and_then(|_| Self::from_small_vibration(scene, direction, range)))
    }

    /// Finds the cycle from the small vibrations at the end of the instability. If they are above the range,
    /// or leave it before they stick, the cycle is followed back into the range.
    fn from_small_vibration(scene: &Scene, direction: f64, range: [f64; 2]) -> Option<Self> {
        /// Factors on the highest speed.
        const WIDER: [f64; 6] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
        /// Number of speeds at which the growth is computed.
        const POINTS: usize = 100;
        let wide = WIDER.iter().find_map(|factor| {
            let wide = [range[0], factor * range[1]];
            let intervals = SlideFinder::new(&scene.linkage, direction).find_intervals(wide, POINTS);
            let end = unstable_range(&intervals).map(|[_, end]| end).filter(|end| *end < wide[1])?;
            BranchWalker::new(scene, direction, wide, end)?.follow_small_vibration(end, direction)
        })?;
        let within = |cycle: &&PeriodicMotion| cycle.speed_m_per_s < range[1] && !cycle.sticks_s.is_empty();
        let near = wide.cycles().iter().rev().find(within)?;
        let (mut walker, start) = wide.solve_near(scene, near, near.speed_m_per_s, range)?;
        Some(walker.follow_cycle(start, direction))
    }

    /// The cycle of a scene next to a motion of this branch, at a speed, m/s; with a walker over a range of
    /// speed.
    fn solve_near(
        &self,
        scene: &Scene,
        near: &PeriodicMotion,
        speed_m_per_s: f64,
        range: [f64; 2],
    ) -> Option<(BranchWalker, Solution)> {
        let mut walker = BranchWalker::new(scene, self.direction, range, speed_m_per_s)?;
        let guess = walker.shooter.unknowns_from(&near.pose, near.period_s, speed_m_per_s);
        let found = walker.shooter.solve(&guess, &by_speed(guess.len()))?;
        // steady sliding also meets the conditions, without stick
        (found.sticks_s.is_empty() == near.sticks_s.is_empty()).then_some((walker, found))
    }

    /// The cycle of the scene of this branch, or of a scene that differs little from it, at a speed, m/s.
    /// `None` if none is found next to the branch.
    #[must_use]
    pub fn find_cycle(&self, scene: &Scene, speed_m_per_s: f64) -> Option<PeriodicMotion> {
        let near = self.nearest_cycle(speed_m_per_s)?;
        let (mut walker, found) = self.solve_near(scene, near, speed_m_per_s, [0.0, speed_m_per_s])?;
        Some(walker.shooter.describe(&found))
    }

    /// The speed at which the cycle of a changed scene ends, m/s. The search starts from a cycle of the scene
    /// itself. `None` if there is no such cycle, or if its branch could not be followed.
    pub(super) fn find_changed_end(&self, scene: &Scene) -> Option<f64> {
        /// Fraction of the speed at which the cycle ends, at which the search starts.
        const SHARE: f64 = 0.97;
        let mut cycles = self.cycles().iter().rev();
        let is_below = |cycle: &&PeriodicMotion| {
            cycle.speed_m_per_s < SHARE * self.end_m_per_s && !cycle.sticks_s.is_empty()
        };
        let near = cycles.find(is_below)?;
        let range = [0.0, 2.0 * self.end_m_per_s];
        let (mut walker, start) = self.solve_near(scene, near, near.speed_m_per_s, range)?;
        let by_speed = by_speed(start.unknowns.len());
        let (found, end, _) = walker.walk(start, &by_speed);
        end.is_turn().then(|| walker.shooter.speed_of(&found[found.len() - 1].unknowns))
    }
}

/// The pose of steady sliding with the tip at rest on the glass.
fn stop_tip(linkage: &Linkage, slide: &SteadySlide, velocity_m_per_s: f64) -> Pose {
    let d = LinkDirections::from_pose(&slide.pose);
    let lip = linkage.l2_m * d.cos_phi;
    if linkage.is_slider() {
        return Pose { phi_rate: -velocity_m_per_s / lip, ..slide.pose };
    }
    let rate = -velocity_m_per_s / (linkage.l1_m * d.cos_theta + lip);
    Pose { theta_rate: rate, phi_rate: rate, ..slide.pose }
}

struct BranchWalker {
    shooter: CycleShooter,
    finder: SlideFinder,
    range: [f64; 2],
}

/// A point of a walk: a solution and the direction of the branch there.
type BranchPoint = (Solution, Unknowns);

type FinishedWalk = (Vec<Solution>, CycleEnd, Option<BranchPoint>);

/// Longest step along a branch, in scales.
const LONGEST: f64 = 0.15;
/// Largest number of runs over a period for one branch.
const MOST_RUNS: usize = 12_000;

impl BranchWalker {
    fn new(scene: &Scene, direction: f64, range: [f64; 2], speed: f64) -> Option<Self> {
        let mut finder = SlideFinder::new(&scene.linkage, direction);
        let mode = finder.find_slide(speed).ok()?.leading_mode();
        let frequency_hz = if mode.frequency_hz > 0.0 {
            mode.frequency_hz
        } else {
            finder.fastest_rad_per_s / std::f64::consts::TAU
        };
        let shooter = CycleShooter::new(scene, direction, speed, 1.0 / frequency_hz);
        Some(Self { shooter, finder, range })
    }

    /// Follows a cycle down and up, and the motions beyond its end.
    fn follow_cycle(&mut self, start: Solution, direction: f64) -> CycleBranch {
        /// Largest number of times that a walk starts again from a simulated run.
        const RESTARTS: usize = 12;
        const IRREGULAR: &str = "above it the blade still chatters, in other cycles or in unequal periods";
        let by_speed = by_speed(start.unknowns.len());
        let (mut found, ..) = self.walk(start.clone(), &-&by_speed);
        found.reverse();
        found.pop();
        let (mut next, mut restarts) = (start, 0);
        let (last, end, problem, beyond) = loop {
            let (up, end, beyond) = self.walk(next, &by_speed);
            found.extend(up);
            let (last, problem) = (found[found.len() - 1].clone(), self.shooter.problem);
            if end == CycleEnd::EndOfRange {
                break (last, end, problem, beyond);
            }
            // a run above the last cycle shows whether the blade still chatters
            let above = match self.settle_above(&last.unknowns) {
                Ok(above) if restarts < RESTARTS => above,
                Ok(_) | Err(true) => break (last, CycleEnd::Undecided, IRREGULAR, None),
                Err(false) => break (last, end, problem, beyond),
            };
            (next, restarts) = (above, restarts + 1);
        };
        let before_end = found.len();
        let end_m_per_s = self.shooter.speed_of(&last.unknowns);
        if end.is_turn()
            && let Some((first, along)) = beyond.or_else(|| self.leave_corner(&last))
        {
            found.extend(self.walk(first, &along).0);
        }
        let problem = if end == CycleEnd::Undecided { problem.to_owned() } else { String::new() };
        let motions = found.iter().map(|solution| self.shooter.describe(solution)).collect();
        CycleBranch { direction, motions, before_end, end, end_m_per_s, problem }
    }

    /// Follows the vibrations without stick that begin where steady sliding becomes stable, up to the first
    /// stick, and then the stick-slip cycle. `None` if no cycle is found there.
    fn follow_small_vibration(&mut self, end: f64, direction: f64) -> Option<CycleBranch> {
        /// Size of the first vibration, in scales.
        const SIZE: f64 = 0.1;
        /// Factors on the speed of the vibration with the first stick.
        const SLOWER: [f64; 5] = [0.9999, 0.999, 0.99, 0.97, 0.9];
        let slide = self.finder.find_slide(end).ok()?;
        let period_s = 1.0 / slide.leading_mode().frequency_hz;
        let rest = self.shooter.unknowns_from(&slide.pose, period_s, end);
        let along = self.shooter.small_vibration_at(&rest)?;
        let first = self.shooter.solve(&(&rest + SIZE * &along), &along)?;
        let (found, ..) = self.walk(first, &along);
        let last = found.last()?.unknowns.clone();
        let by_speed = by_speed(last.len());
        let start = SLOWER.iter().find_map(|factor| {
            let mut guess = last.clone();
            guess[last.len() - 1] *= *factor;
            self.shooter.solve(&guess, &by_speed).filter(|solution| !solution.sticks_s.is_empty())
        })?;
        Some(self.follow_cycle(start, direction))
    }

    /// A cycle with stick at a slightly higher speed, which a run reaches from the state of another.
    ///
    /// # Errors
    /// If no such cycle is found: whether the tip still sticks.
    fn settle_above(&mut self, unknowns: &Unknowns) -> Result<Solution, bool> {
        /// Factors by which the speed rises.
        const RISES: [f64; 2] = [1.003, 1.02];
        let (pose, speed) = (self.shooter.pose_of(unknowns), self.shooter.speed_of(unknowns));
        let [near, far] = RISES.map(|rise| rise * speed);
        self.shooter.settle(pose, near).or_else(|_| self.shooter.settle(pose, far))
    }

    /// The first motion without stick beyond a corner, with the direction of the branch there. The branch is
    /// sought on the side of smaller motions.
    fn leave_corner(&mut self, corner: &Solution) -> Option<BranchPoint> {
        /// Fraction by which the motion becomes smaller, so that its tip does not stop.
        const SHRINK: f64 = 1e-3;
        const STEPS: [f64; 4] = [3e-3, 1e-2, 3e-2, 1e-3];
        let slide = self.slide_unknowns(corner)?;
        let mut inwards = &slide - &corner.unknowns;
        let n = self.shooter.state_count();
        inwards.rows_range_mut(n..).fill(0.0);
        let near = self.shooter.linearise(&(&corner.unknowns + SHRINK * &inwards))?;
        let along = self.shooter.tangent_of(&near, &inwards)?;
        STEPS.iter().find_map(|step| {
            let guess = &corner.unknowns + *step * &along;
            let first = self.shooter.solve(&guess, &along)?;
            let along = self.shooter.tangent_of(&first, &along)?;
            (first.sticks_s.len() < corner.sticks_s.len()).then_some((first, along))
        })
    }

    /// Steady sliding at the speed of a solution, with the period of the solution.
    fn slide_unknowns(&mut self, solution: &Solution) -> Option<Unknowns> {
        let speed = self.shooter.speed_of(&solution.unknowns);
        let slide = self.finder.find_slide(speed).ok()?;
        Some(self.shooter.unknowns_from(&slide.pose, self.shooter.period_of(&solution.unknowns), speed))
    }

    /// Follows a branch until it turns back, ends or leaves the range of speed. Returns the solutions, how
    /// the walk ends, and the first point beyond a turn, if it is found.
    fn walk(&mut self, start: Solution, along: &Unknowns) -> FinishedWalk {
        /// Largest number of points of a walk.
        const POINTS: usize = 150;
        /// First step, step below which the branch counts as interrupted, and factor of growth of a step.
        const FIRST: f64 = 0.03;
        const SHORTEST: f64 = 1e-3;
        const GROWTH: f64 = 1.4;
        /// Fraction of the highest speed below which a branch is not followed.
        const SLOW: f64 = 0.02;
        /// A motion closer than this, in scales, to steady sliding has become steady sliding.
        const NEAR: f64 = 0.02;
        let mut found = vec![start.clone()];
        let Some(tangent) = self.shooter.tangent_of(&start, along) else {
            return (found, CycleEnd::Undecided, None);
        };
        let (mut at, mut step): (BranchPoint, f64) = ((start, tangent), FIRST);
        while found.len() < POINTS && self.shooter.runs < MOST_RUNS {
            let speed = self.shooter.speed_of(&at.0.unknowns);
            let [lowest, highest] = self.range;
            let is_slow = speed < lowest.max(SLOW * highest) && speed_rate(&at) < 0.0;
            if speed > highest || is_slow {
                found.truncate((found.len() - 1).max(1));
                return (found, CycleEnd::EndOfRange, None);
            }
            let slide = self.slide_unknowns(&at.0);
            if slide.is_none_or(|slide| (slide - &at.0.unknowns).norm() < NEAR) {
                break;
            }
            let next = self.advance(&at, step);
            let is_same = next.as_ref().is_some_and(|next| has_gone_on(&at, next));
            let is_smooth = next.as_ref().is_some_and(|next| next.1.dot(&at.1) > 0.9);
            if let Some(next) = next.clone().filter(|_| is_same && is_smooth) {
                found.push(next.0.clone());
                (at, step) = (next, (GROWTH * step).min(LONGEST));
                continue;
            }
            if (next.is_none() || is_same) && step > SHORTEST {
                step *= 0.5;
                continue;
            }
            let (before, beyond) = self.approach_change(&at, step, next);
            let beyond = beyond.and_then(|beyond| self.turn_away(&before, beyond));
            found.push(before.0.clone());
            match beyond {
                Some(beyond) if turns_back(&before, &beyond) => {
                    let is_fold = beyond.0.sticks_s.len() == before.0.sticks_s.len();
                    let kind = if is_fold { CycleEnd::Fold } else { CycleEnd::StickLost };
                    return (found, kind, Some(beyond));
                }
                Some(beyond) => {
                    found.push(beyond.0.clone());
                    (at, step) = (beyond, FIRST.min(step));
                }
                None if self.has_short_stick(&before.0) => return (found, CycleEnd::StickLost, None),
                None if self.misses_stick(&before.0) => return (found, CycleEnd::Grazing, None),
                None => break,
            }
        }
        (found, CycleEnd::Undecided, None)
    }

    /// The direction of the branch beyond a change of the number of sticks: that in which this number stays.
    /// `None` if the number stays in neither direction.
    fn turn_away(&mut self, before: &BranchPoint, beyond: BranchPoint) -> Option<BranchPoint> {
        /// Length of the step that tries a direction, in scales.
        const PROBE: f64 = 1e-5;
        let sticks = beyond.0.sticks_s.len();
        if sticks == before.0.sticks_s.len() {
            return Some(beyond);
        }
        let (solution, along) = beyond;
        [1.0, -1.0].into_iter().find_map(|sign| {
            let along = sign * &along;
            let next = self.advance(&(solution.clone(), along.clone()), PROBE)?;
            (next.0.sticks_s.len() == sticks).then(|| (solution.clone(), along))
        })
    }

    /// Whether the tip stops less often in a period if the head is slightly faster than in a cycle.
    fn misses_stick(&mut self, solution: &Solution) -> bool {
        /// Factor on the speed.
        const FASTER: f64 = 1.0 + 1e-4;
        let Self { shooter, .. } = self;
        let (pose, period_s) = (shooter.pose_of(&solution.unknowns), shooter.period_of(&solution.unknowns));
        let speed = FASTER * shooter.speed_of(&solution.unknowns);
        shooter.count_sticks(pose, speed, period_s).is_some_and(|sticks| sticks < solution.sticks_s.len())
    }

    fn has_short_stick(&self, solution: &Solution) -> bool {
        /// Part of a period below which a stick is an instant.
        const SHORT: f64 = 1e-2;
        let period_s = self.shooter.period_of(&solution.unknowns);
        solution.sticks_s.iter().any(|stick_s| *stick_s < SHORT * period_s)
    }

    fn advance(&mut self, (from, along): &BranchPoint, step: f64) -> Option<BranchPoint> {
        let solution = self.shooter.solve(&(&from.unknowns + step * along), along)?;
        let tangent = self.shooter.tangent_of(&solution, along)?;
        Some((solution, tangent))
    }

    /// Approaches a turn, a change of the number of sticks or a gap of the branch by bisection. Returns the
    /// last point before it and the first one beyond it.
    fn approach_change(
        &mut self,
        at: &BranchPoint,
        mut ahead: f64,
        mut beyond: Option<BranchPoint>,
    ) -> (BranchPoint, Option<BranchPoint>) {
        /// Distance at which the bisection ends, in scales.
        const CLOSE: f64 = 1e-10;
        let mut before = at.clone();
        while ahead > CLOSE && self.shooter.runs < MOST_RUNS {
            ahead *= 0.5;
            let middle = self.advance(&before, ahead);
            match middle {
                Some(middle) if has_gone_on(at, &middle) => before = middle,
                other => beyond = other,
            }
        }
        (before, beyond)
    }
}

/// Change of the speed per step, in scales.
fn speed_rate((_, along): &BranchPoint) -> f64 {
    along[along.len() - 1]
}

/// Whether the branch turns back to speeds that it has passed.
fn turns_back(before: &BranchPoint, beyond: &BranchPoint) -> bool {
    speed_rate(before) * speed_rate(beyond) < 0.0
}

/// Whether two points belong to one piece of a branch, without a turn and with the same number of sticks.
fn has_gone_on(before: &BranchPoint, beyond: &BranchPoint) -> bool {
    !turns_back(before, beyond) && before.0.sticks_s.len() == beyond.0.sticks_s.len()
}
