//! A camera and a tracking program. They use no function of the fit.

use crate::linkage_run::Place;
use portable_math::StandardNormal;
use rand::Rng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wiperlab::recording::{FrameGrid, Recording, Traces};

/// How a blade is filmed.
#[derive(Clone)]
pub struct Filming {
    pub frame_rate_hz: f64,
    /// Numbers of steps of the run in one frame period and in one exposure; both are even.
    pub steps: [usize; 2],
    pub origin_m: [f64; 2],
    pub tilt_rad: f64,
    pub scale: f64,
    /// Position of the head's marker relative to the hinge: along the sweep and upwards, m.
    pub head_marker_m: [f64; 2],
    /// Position of the tip's marker relative to the edge of the lip: along and across the lip, m.
    pub tip_marker_m: [f64; 2],
    /// Curvature of the glass, 1/m, and the position along the sweep at which the glass is level, m.
    pub curvature_per_m: f64,
    pub level_at_m: f64,
    /// Noise of a coordinate: standard deviation, m, correlation between neighbouring frames, and fraction of
    /// the variance that tip and head share.
    pub noise_m: f64,
    pub correlation: f64,
    pub shared: f64,
    /// Probability that a point is lost in a frame.
    pub lost: f64,
    /// First frame and number of the frames in which the tracked tip is off along the sweep, by ten standard
    /// deviations of the noise.
    pub glued: Option<[usize; 2]>,
}

impl Filming {
    /// Draws a camera. Its lengths and times scale with `size` and `time`, which are 1 for the blade of the
    /// scene.
    pub fn draw(
        generator: &mut Xoshiro256PlusPlus,
        size: f64,
        time: f64,
        stroke_m: f64,
        lip_hz: f64,
    ) -> Self {
        /// Minimum number of steps of the run in a period of the lip.
        const STEPS_A_PERIOD: f64 = 100.0;
        let mut within = |low: f64, high: f64| low + (high - low) * generator.random::<f64>();
        let frame_rate_hz = 2_000.0 * within(0.0, 5.0_f64.ln()).exp() / time;
        let steps = 2 * (0.5 * STEPS_A_PERIOD * lip_hz / frame_rate_hz).ceil() as usize;
        let open = 2 * ((0.5 * within(0.1, 0.5) * steps as f64) as usize).max(1);
        let is_curved = within(0.0, 1.0) < 0.5;
        let is_correlated = within(0.0, 1.0) < 0.5;
        let mut filming = Self {
            frame_rate_hz,
            steps: [steps, open],
            origin_m: [within(-5e-3, 5e-3), within(-5e-3, 5e-3)].map(|m| m * size),
            tilt_rad: within(-0.5, 0.5).to_radians(),
            scale: 1.0,
            head_marker_m: [0.0; 2],
            tip_marker_m: [0.0; 2],
            curvature_per_m: if is_curved { 1.0 / (size * within(1.0, 5.0)) } else { 0.0 },
            level_at_m: stroke_m * within(0.3, 0.7),
            noise_m: size * 1e-6 * within(1.0, 4.0),
            correlation: if is_correlated { within(0.0, 0.7) } else { 0.0 },
            shared: if is_correlated { within(0.0, 0.5) } else { 0.0 },
            lost: within(0.0, 0.2),
            glued: None,
        };
        let mut normal = |sd: f64| sd * generator.sample::<f64, _>(StandardNormal);
        filming.scale += normal(2e-3);
        filming.head_marker_m = [normal(2e-4 * size), normal(2e-4 * size)];
        filming.tip_marker_m = [normal(1e-4 * size), normal(1e-4 * size)];
        filming
    }

    /// Films a run. `places` are one step apart; `upright_m` is the height of the head of an upright blade,
    /// m.
    pub fn film(&self, places: &[Place], upright_m: f64, generator: &mut Xoshiro256PlusPlus) -> Recording {
        let [steps, open] = self.steps;
        let mut noise = [0.0_f64; 6];
        let mut columns: [Vec<Option<f64>>; 4] = std::array::from_fn(|_| Vec::new());
        for (frame, from) in (0..places.len().saturating_sub(open)).step_by(steps).enumerate() {
            for value in &mut noise {
                let fresh: f64 = generator.sample(StandardNormal);
                let rho = if frame == 0 { 0.0 } else { self.correlation };
                *value = rho * *value + (1.0 - rho * rho).sqrt() * fresh;
            }
            let seen = self.expose(&places[from..=from + open], upright_m);
            let lost = [0, 1].map(|_| generator.random::<f64>() < self.lost);
            let is_glued = self.glued.is_some_and(|[first, count]| (first..first + count).contains(&frame));
            for (i, column) in columns.iter_mut().enumerate() {
                let off = if is_glued && i == 0 { 10.0 } else { 0.0 };
                let error = self.shared.sqrt() * noise[i % 2] + (1.0 - self.shared).sqrt() * noise[2 + i];
                column.push((!lost[i / 2]).then_some(seen[i] + self.noise_m * (error + off)));
            }
        }
        let [tip_x_m, tip_y_m, head_x_m, head_y_m] = columns;
        let grid = FrameGrid { start_s: 0.0, frame_rate_hz: self.frame_rate_hz, frames: tip_x_m.len() };
        let traces = Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, ..Traces::default() };
        Recording::new("synthetic", grid, traces, true).expect("finite places")
    }

    /// Mean over the exposure, by Simpson's rule: x and y of the tip, then of the head, m.
    fn expose(&self, places: &[Place], upright_m: f64) -> [f64; 4] {
        let last = places.len() - 1;
        let mut sum = [0.0; 4];
        for (i, place) in places.iter().enumerate() {
            let weight = if i == 0 || i == last { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
            let seen = self.show(place, upright_m);
            sum.iter_mut().zip(seen).for_each(|(sum, seen)| *sum += weight * seen / (3 * last) as f64);
        }
        sum
    }

    /// Both markers in the picture at one instant: x and y of the tip, then of the head, m.
    fn show(&self, place: &Place, upright_m: f64) -> [f64; 4] {
        let ([along, across], (sin, cos)) = (self.tip_marker_m, place.lip_rad.sin_cos());
        let tip =
            [place.tip_x_m + along * sin + across * cos, place.tip_height_m - along * cos + across * sin];
        let [aside, above] = self.head_marker_m;
        let head = [place.head_x_m + aside, upright_m - place.drop_m + above];
        let [[tip_x, tip_y], [head_x, head_y]] = [tip, head].map(|[along_m, height_m]| {
            let (x, y) = self.bend(along_m, height_m);
            let (sin, cos) = self.tilt_rad.sin_cos();
            let [right, up] = self.origin_m;
            [self.scale * (x * cos - y * sin) + right, self.scale * (x * sin + y * cos) + up]
        });
        [tip_x, tip_y, head_x, head_y]
    }

    /// Position, m, of a point that is `along_m` along the glass and `height_m` above it. The glass is an
    /// arc.
    fn bend(&self, along_m: f64, height_m: f64) -> (f64, f64) {
        if self.curvature_per_m == 0.0 {
            return (along_m, height_m);
        }
        let radius = 1.0 / self.curvature_per_m;
        let (sin, cos) = ((along_m - self.level_at_m) / radius).sin_cos();
        (self.level_at_m + (radius - height_m) * sin, radius - (radius - height_m) * cos)
    }
}
