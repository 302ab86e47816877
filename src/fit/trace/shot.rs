//! One run of the model over a segment, as the camera sees it.

use super::film::Film;
use super::unknown::{Kind, Unknowns, View};
use crate::blade::Pose;
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::shutter::Shutters;
use crate::simulate::{Effort, Observer, Piece, Status, run_with};
use nalgebra::{DMatrix, DVector, Vector4};

/// Angles and rates of neck and lip.
pub(super) type State = Vector4<f64>;

/// Tolerance of a segment's runs: their errors stay a thousandth of a pixel's noise.
const TOLERANCE: f64 = 1e-8;
/// Right-hand sides after which a segment's run is given up.
const MOST_EVALUATIONS: u64 = 400_000;

pub(super) fn pose_of(s: &State) -> Pose {
    Pose { theta: s[0], phi: s[1], theta_rate: s[2], phi_rate: s[3] }
}

pub(super) fn state_of(pose: &Pose) -> State {
    State::new(pose.theta, pose.phi, pose.theta_rate, pose.phi_rate)
}

/// What the camera sees of a run: lean of the tip against the head and drop, m, a pair a frame, and the
/// state at the end.
pub(super) struct Shot {
    pub frames: Vec<[f64; 2]>,
    pub end: State,
}

/// Keeps the pose in which a run ends.
#[derive(Default)]
struct LastPose(Option<Pose>);

impl Observer for LastPose {
    fn piece(&mut self, piece: &Piece<'_>) {
        self.0 = Some(piece.pose(piece.end_s));
    }
}

/// Runs the model from `state` over frames `first` to before `last`, on the drive's clock; `None` where the
/// run ends early. The end is where the next segment starts.
pub(super) fn shoot(
    scene: &Scene,
    film: &Film,
    clock_s: f64,
    [first, last]: [usize; 2],
    state: &State,
) -> Option<Shot> {
    let lead = film.lead_s();
    let mut scene = scene.clone();
    let times: Vec<f64> = film.times_s[first..last].iter().map(|t| t - clock_s).collect();
    scene.start_s = times[0] - lead;
    scene.start = StartKind::State(pose_of(state));
    scene.run.stop_s = match film.times_s.get(last) {
        Some(next) => next - clock_s - lead,
        None => times[times.len() - 1] + lead + 1e-9,
    };
    let [start_s, stop_s] = [scene.start_s, scene.run.stop_s];
    let open = times.iter().map(|t| [(t - lead).max(start_s), (t + lead).min(stop_s)]);
    let mut frames = Vec::with_capacity(last - first);
    let shutters =
        Shutters::new(open, |place| frames.push([place.tip_x_m - place.head_x_m, place.head_drop_m]));
    let mut observers = (shutters, LastPose::default());
    let effort = Effort { most_evaluations: MOST_EVALUATIONS, ..Effort::new(TOLERANCE) };
    let run = run_with(&scene, effort, &mut observers);
    let end = observers.1.0;
    let whole = run.status == Status::Completed && frames.len() == last - first;
    whole.then_some(())?;
    Some(Shot { frames, end: state_of(&end?) })
}

/// Residuals of a segment in standard deviations of the noise: the tip's frames, then the drop's.
pub(super) fn residuals(film: &Film, view: &View, first: usize, frames: &[[f64; 2]]) -> DVector<f64> {
    let scale = 1.0 + view.scale;
    let [tip_sd, drop_sd] = film.settings.noise_m;
    let tip = frames.iter().enumerate().filter_map(|(i, [lean, drop])| {
        let seen = film.tip_x_m[first + i]?;
        let head = film.head_m[first + i] * if film.own_head { 1.0 } else { scale };
        let model = head + scale * (lean - view.tilt_rad * drop) + view.offset_x_m;
        Some((model - seen) / tip_sd)
    });
    let fall = frames.iter().enumerate().filter_map(|(i, [_, drop])| {
        let seen = film.drop_m[first + i]?;
        let along = film.head_m[first + i] - film.centre_m;
        Some((scale * drop - view.tilt_rad * along + view.offset_drop_m - seen) / drop_sd)
    });
    DVector::from_iterator(film.count(first, first + frames.len()), tip.chain(fall))
}

/// Residuals with their derivatives by the starting state and by the unknowns.
pub(super) struct Linear {
    pub residuals: DVector<f64>,
    pub by_state: DMatrix<f64>,
    pub by_unknown: DMatrix<f64>,
}

/// A model at one point of the search.
pub(super) struct Point<'a> {
    pub film: &'a Film,
    pub view: View,
    pub scene: Scene,
    /// The same with each unknown moved a little.
    pub moved: Vec<(Scene, View)>,
}

pub(super) const STATE_STEPS: [f64; 4] = [3e-5, 3e-5, 0.1, 0.1];
const STEP: f64 = 2e-4;

impl<'a> Point<'a> {
    pub fn new(base: &Scene, film: &'a Film, number: usize, unknowns: &Unknowns, z: &[f64]) -> Option<Self> {
        Some(Self {
            film,
            view: unknowns.view(number, z),
            scene: unknowns.scene(base, film.own_head, number, z)?,
            moved: Vec::new(),
        })
    }

    pub fn with_moved(mut self, base: &Scene, number: usize, unknowns: &Unknowns, z: &[f64]) -> Option<Self> {
        for (i, unknown) in unknowns.0.iter().enumerate() {
            let mut moved = z.to_vec();
            moved[i] += STEP;
            let other = matches!(unknown.kind, Kind::Camera { film, .. } if film != number);
            let scene = if other {
                self.scene.clone()
            } else {
                unknowns.scene(base, self.film.own_head, number, &moved)?
            };
            self.moved.push((scene, unknowns.view(number, &moved)));
        }
        Some(self)
    }

    pub fn shoot(&self, frames: [usize; 2], state: &State) -> Option<Shot> {
        shoot(&self.scene, self.film, self.view.clock_s, frames, state)
    }

    pub fn residuals(&self, frames: [usize; 2], state: &State) -> Option<DVector<f64>> {
        let shot = self.shoot(frames, state)?;
        Some(residuals(self.film, &self.view, frames[0], &shot.frames))
            .filter(|r| r.iter().all(|x| x.is_finite()))
    }

    pub fn by_state(&self, frames: [usize; 2], state: &State, at: &DVector<f64>) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(at.len(), 4);
        for i in 0..4 {
            let column = [STATE_STEPS[i], -STATE_STEPS[i]].into_iter().find_map(|h| {
                let mut moved = *state;
                moved[i] += h;
                self.residuals(frames, &moved).map(|r| (r - at) / h)
            });
            jacobian.set_column(i, &column?);
        }
        Some(jacobian)
    }

    pub fn linear(&self, frames: [usize; 2], state: &State) -> Option<Linear> {
        let at = self.residuals(frames, state)?;
        let by_state = self.by_state(frames, state, &at)?;
        let mut by_unknown = DMatrix::zeros(at.len(), self.moved.len());
        for (i, (scene, view)) in self.moved.iter().enumerate() {
            let shot = shoot(scene, self.film, view.clock_s, frames, state)?;
            let moved = residuals(self.film, view, frames[0], &shot.frames);
            by_unknown.set_column(i, &((moved - &at) / STEP));
        }
        Some(Linear { residuals: at, by_state, by_unknown })
    }
}
