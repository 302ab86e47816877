//! Where the picture of a camera shows a blade on curved glass, with derivatives.
//!
//! The glass is an arc. At the mean position of the head it makes the angle of the tilt with the x axis of
//! the picture. The picture is not linear in tilt and curvature: on a blade 3 mm high with a slope of
//! 0.04 rad, the terms of second order are as large as the tracking noise.

use super::unknowns::{CameraParameters, CameraUnknown};
use portable_math as math;

/// A camera and what it films.
#[derive(Debug, Clone, Copy)]
pub(super) struct PictureGeometry {
    pub camera: CameraParameters,
    /// Height of the head of the upright blade, m.
    upright_m: f64,
    /// Mean position of the head along the sweep over the fitted frames, m: in the picture if the recorded
    /// head drives the model, otherwise its true position.
    centre_m: f64,
    /// Sine and cosine of the tilt.
    tilt: [f64; 2],
}

/// A point in the picture, m, and the derivatives of its coordinates.
#[derive(Debug, Clone, Copy)]
struct PicturePoint {
    at: [f64; 2],
    by_along: [f64; 2],
    by_height: [f64; 2],
    by_tilt: [f64; 2],
    by_curvature: [f64; 2],
}

/// A frame of the model as the picture shows it.
pub(super) struct FrameProjection<'a> {
    geometry: &'a PictureGeometry,
    tip: PicturePoint,
    head: PicturePoint,
    /// If the recorded head drives the model: where the recording shows the head along the sweep, m, and
    /// where the model shows the marker of an upright blade at the same place. The distance of the tip counts
    /// from the second and is added to the first. `None` if the scene moves the head.
    seen_head: Option<(f64, PicturePoint)>,
    /// Sine and cosine of the angle of the lip.
    lip: [f64; 2],
    /// Time after the middle of the fitted frames, s.
    after_s: f64,
}

impl PictureGeometry {
    pub(super) fn new(camera: CameraParameters, upright_m: f64, centre_m: f64) -> Self {
        let tilt = [math::sin(camera.tilt_rad), math::cos(camera.tilt_rad)];
        Self { camera, upright_m, centre_m, tilt }
    }

    /// The picture of a point that lies `along_m` along the glass and `height_m` above it.
    fn project_point(&self, along_m: f64, height_m: f64) -> PicturePoint {
        let curvature = self.camera.curvature_per_m;
        let angle = curvature * along_m;
        // position on the arc, its derivatives by the curvature, and sine and cosine of the slope
        let ([x, y], [x_by, y_by], [sin, cos]) = arc_point(curvature, along_m, angle);
        let on_arc = |[x, y]: [f64; 2]| {
            let [sin, cos] = self.tilt;
            [x * cos - y * sin, x * sin + y * cos]
        };
        let [right, up] = on_arc([x - height_m * sin, y + height_m * cos]);
        let stretch = 1.0 - curvature * height_m;
        PicturePoint {
            at: [right, up],
            by_along: on_arc([stretch * cos, stretch * sin]),
            by_height: on_arc([-sin, cos]),
            by_tilt: [-up, right],
            by_curvature: on_arc([x_by - height_m * along_m * cos, y_by - height_m * along_m * sin]),
        }
    }

    /// True position of the recorded head along the glass, m, from the mean position, if the picture shows
    /// its marker at `seen_m`. The marker is taken at the height of an upright blade: the smooth curve
    /// through the recorded positions hardly follows the drop of a blade that flips. The zero is chosen
    /// so that a head at the mean position is seen there if its marker is at the hinge.
    pub(super) fn locate_head(&self, seen_m: f64) -> f64 {
        /// Number of steps of Newton's method. After the first, the error is a nanometre at usual angles.
        const STEPS: usize = 3;
        let from_centre_m = (seen_m - self.centre_m) / (1.0 + self.camera.scale);
        let target_m = from_centre_m - self.upright_m * self.tilt[0];
        (0..STEPS).fold(from_centre_m, |along_m, _| {
            let point = self.project_point(along_m, self.upright_head_m());
            along_m - (point.at[0] - target_m) / point.by_along[0]
        })
    }

    /// Height of the head's marker on the upright blade, m.
    fn upright_head_m(&self) -> f64 {
        self.upright_m + self.camera.head_above_m
    }

    /// Whether the glass slopes anywhere in the picture.
    pub(super) fn slopes(&self) -> bool {
        self.camera.tilt_rad != 0.0 || self.camera.curvature_per_m != 0.0
    }

    /// Relative change of the true motion of a recorded head per unit of a camera error, near the mean
    /// position; `None` for an error that does not stretch the motion.
    pub(super) fn stretch_by(&self, what: CameraUnknown) -> Option<f64> {
        let CameraParameters { scale, curvature_per_m, .. } = self.camera;
        let below_centre = 1.0 - curvature_per_m * self.upright_head_m();
        match what {
            CameraUnknown::Scale => Some(-1.0 / (1.0 + scale)),
            CameraUnknown::Tilt => Some(self.tilt[0] / self.tilt[1]),
            CameraUnknown::Curvature => Some(self.upright_head_m() / below_centre),
            CameraUnknown::HeadAbove => Some(curvature_per_m / below_centre),
            _ => None,
        }
    }

    /// The picture of a frame with the true positions of tip and head along the sweep, the drop, m, and the
    /// angle of the lip, rad. `seen_head_m` is the position of the head in the picture if the recorded head
    /// drives the model; `after_s` is the time after the middle of the fitted frames, s.
    pub(super) fn project_frame(
        &self,
        seen_head_m: Option<f64>,
        after_s: f64,
        [tip, head, drop, lip]: [f64; 4],
    ) -> FrameProjection<'_> {
        let along_m = head - self.centre_m;
        let [along_lip_m, across_lip_m] = self.camera.tip_marker_m;
        let lip = [math::sin(lip), math::cos(lip)];
        let shift_m = along_lip_m * lip[0] + across_lip_m * lip[1];
        let rise_m = across_lip_m * lip[0] - along_lip_m * lip[1];
        let upright = || self.project_point(along_m, self.upright_head_m());
        FrameProjection {
            geometry: self,
            tip: self.project_point(tip - self.centre_m + shift_m, rise_m),
            head: self.project_point(along_m, self.upright_head_m() - drop),
            seen_head: seen_head_m.map(|seen_m| (seen_m, upright())),
            lip,
            after_s,
        }
    }
}

impl FrameProjection<'_> {
    fn scale(&self) -> f64 {
        1.0 + self.geometry.camera.scale
    }

    /// Position of a point along the sweep in the picture, m. The zero of a recorded head is that of its
    /// recording.
    fn show_along(&self, point: &PicturePoint) -> f64 {
        match &self.seen_head {
            Some((seen_m, head)) => seen_m + self.scale() * (point.at[0] - head.at[0]),
            None => self.scale() * (self.geometry.centre_m + point.at[0]),
        }
    }

    /// Position of the tip along the sweep and drop of the head in the picture, m.
    pub(super) fn picture(&self) -> [f64; 2] {
        let [offset_x_m, offset_drop_m] = self.geometry.camera.offsets_m(self.after_s);
        let drop_m = self.scale() * (self.geometry.upright_head_m() - self.head.at[1]);
        [self.show_along(&self.tip) + offset_x_m, drop_m + offset_drop_m]
    }

    /// Position of the head along the sweep in the picture, m.
    pub(super) fn head_in_picture(&self) -> f64 {
        match self.seen_head {
            Some((seen_m, _)) => seen_m,
            None => self.show_along(&self.head) + self.geometry.camera.offset_x_m,
        }
    }

    /// Derivatives of the picture with respect to the true positions of tip and head, the drop, m, and the
    /// angle of the lip, rad.
    pub(super) fn by_means(&self) -> [[f64; 2]; 4] {
        let scale = self.scale();
        let [along_lip_m, across_lip_m] = self.geometry.camera.tip_marker_m;
        let [sin, cos] = self.lip;
        let [turn_along, turn_up] =
            [along_lip_m * cos - across_lip_m * sin, across_lip_m * cos + along_lip_m * sin];
        let [along, up] = [self.tip.by_along[0], self.tip.by_height[0]];
        let by_head = self.seen_head.map_or(0.0, |(_, head)| head.by_along[0]);
        [
            [scale * along, 0.0],
            [-scale * by_head, -scale * self.head.by_along[1]],
            [0.0, scale * self.head.by_height[1]],
            [scale * (along * turn_along + up * turn_up), 0.0],
        ]
    }

    /// Derivatives of the picture with respect to a camera error at the same true positions.
    pub(super) fn by_camera(&self, what: CameraUnknown) -> [f64; 2] {
        let scale = self.scale();
        let ([sin, cos], [along, up]) = (self.lip, [self.tip.by_along[0], self.tip.by_height[0]]);
        let change = |of: &dyn Fn(&PicturePoint) -> [f64; 2]| {
            let by_head = self.seen_head.map_or(0.0, |(_, head)| of(&head)[0]);
            [scale * (of(&self.tip)[0] - by_head), -scale * of(&self.head)[1]]
        };
        match what {
            CameraUnknown::OffsetX => [1.0, 0.0],
            CameraUnknown::OffsetDrop => [0.0, 1.0],
            CameraUnknown::TipAlong => [scale * (along * sin - up * cos), 0.0],
            CameraUnknown::TipAcross => [scale * (along * cos + up * sin), 0.0],
            CameraUnknown::HeadAbove => {
                let aside = self.seen_head.map_or(0.0, |(_, head)| head.by_height[0]);
                [-scale * aside, scale * (1.0 - self.head.by_height[1])]
            }
            CameraUnknown::DriftX => [self.after_s, 0.0],
            CameraUnknown::DriftDrop => [0.0, self.after_s],
            CameraUnknown::Scale => {
                let zero_m = self.seen_head.map_or(-self.geometry.centre_m, |(_, head)| head.at[0]);
                [self.tip.at[0] - zero_m, self.geometry.upright_head_m() - self.head.at[1]]
            }
            CameraUnknown::Tilt => change(&|point| point.by_tilt),
            CameraUnknown::Curvature => change(&|point| point.by_curvature),
            CameraUnknown::Clock => [0.0; 2],
        }
    }
}

/// Position of a point of an arc that touches the x axis at the origin, m, the derivatives of this position
/// with respect to the curvature, and the sine and cosine of the slope. `angle` is the product of curvature
/// and distance from the origin along the arc.
fn arc_point(curvature: f64, along_m: f64, angle: f64) -> ([f64; 2], [f64; 2], [f64; 2]) {
    /// Angle below which the series are exact to rounding errors.
    const SMALL: f64 = 0.05;
    let square = angle * angle;
    if angle.abs() < SMALL {
        // (a polynomial of the square, from its highest coefficient on)
        let sum = |terms: [f64; 4]| terms.into_iter().fold(0.0, |sum, term| sum * square + term);
        let sine = sum([-1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0, 1.0]);
        let cosine = sum([-1.0 / 40320.0, 1.0 / 720.0, -1.0 / 24.0, 0.5]);
        let x_by = angle * sum([1.0 / 45360.0, -1.0 / 840.0, 1.0 / 30.0, -1.0 / 3.0]);
        let y_by = sum([-1.0 / 5760.0, 1.0 / 144.0, -1.0 / 8.0, 0.5]);
        let of_square = along_m * along_m;
        return (
            [along_m * sine, along_m * angle * cosine],
            [of_square * x_by, of_square * y_by],
            [angle * sine, 1.0 - square * cosine],
        );
    }
    let (sin, cos) = (math::sin(angle), math::cos(angle));
    let at = [sin / curvature, (1.0 - cos) / curvature];
    (at, [(along_m * cos - at[0]) / curvature, (along_m * sin - at[1]) / curvature], [sin, cos])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(tilt_rad: f64, curvature_per_m: f64) -> CameraParameters {
        CameraParameters {
            offset_x_m: 3e-4,
            offset_drop_m: -2e-3,
            tip_marker_m: [1e-4, -2e-4],
            head_above_m: 4e-4,
            drift_x_m_per_s: 1e-4,
            drift_drop_m_per_s: -3e-4,
            scale: 0.02,
            tilt_rad,
            curvature_per_m,
            clock_s: 0.0,
        }
    }

    const UPRIGHT_M: f64 = 6e-3;
    const CENTRE_M: f64 = 0.03;
    const MEANS: [f64; 4] = [0.0512, 0.05, 4e-4, 0.6];

    /// Position of a point in the picture: the centre of the arc, and from it to the point.
    fn exact_point(camera: &CameraParameters, along_m: f64, height_m: f64) -> [f64; 2] {
        let radius = 1.0 / camera.curvature_per_m;
        let (tilt, turned) = (camera.tilt_rad, camera.tilt_rad + along_m / radius);
        [
            -radius * tilt.sin() + (radius - height_m) * turned.sin(),
            radius * tilt.cos() - (radius - height_m) * turned.cos(),
        ]
    }

    #[test]
    fn the_picture_of_a_frame_is_exact() {
        for (tilt, curvature) in [(0.3, 8.0), (-0.04, 0.9), (0.01, -0.2), (1e-3, 1e-4)] {
            let camera = camera(tilt, curvature);
            let geometry = PictureGeometry::new(camera, UPRIGHT_M, CENTRE_M);
            let [tip, head, drop, lip] = MEANS;
            let [_, y] = exact_point(&camera, head - CENTRE_M, UPRIGHT_M + camera.head_above_m - drop);
            let [along, across] = camera.tip_marker_m;
            let marker = [along * lip.sin() + across * lip.cos(), across * lip.sin() - along * lip.cos()];
            let [tip_x, _] = exact_point(&camera, tip - CENTRE_M + marker[0], marker[1]);
            let (scale, after_s) = (1.0 + camera.scale, 0.1);
            let shown_drop = scale * (UPRIGHT_M + camera.head_above_m - y)
                + camera.offset_drop_m
                + after_s * camera.drift_drop_m_per_s;
            let offset = camera.offset_x_m + after_s * camera.drift_x_m_per_s;
            // the scene moves the head
            let found = geometry.project_frame(None, after_s, MEANS).picture();
            let expected = [scale * (CENTRE_M + tip_x) + offset, shown_drop];
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{found:?} {expected:?}");
            // a recorded head is taken at the height of an upright blade
            let [upright_x, _] = exact_point(&camera, head - CENTRE_M, UPRIGHT_M + camera.head_above_m);
            let zero = CENTRE_M + scale * UPRIGHT_M * tilt.sin();
            let seen = zero + scale * upright_x;
            assert!((geometry.locate_head(seen) - (head - CENTRE_M)).abs() < 1e-9);
            let shown = geometry.project_frame(Some(seen), after_s, MEANS);
            let (found, expected) = (shown.picture(), [zero + scale * tip_x + offset, shown_drop]);
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{found:?} {expected:?}");
            assert_eq!(shown.head_in_picture(), seen);
        }
    }

    /// Derivatives against central differences.
    #[test]
    fn derivatives_of_the_picture_are_exact() {
        type Change = fn(&mut CameraParameters, f64);
        let changes: [(CameraUnknown, Change, f64); 10] = [
            (CameraUnknown::OffsetX, |c, by| c.offset_x_m += by, 1e-6),
            (CameraUnknown::OffsetDrop, |c, by| c.offset_drop_m += by, 1e-6),
            (CameraUnknown::TipAlong, |c, by| c.tip_marker_m[0] += by, 1e-6),
            (CameraUnknown::TipAcross, |c, by| c.tip_marker_m[1] += by, 1e-6),
            (CameraUnknown::HeadAbove, |c, by| c.head_above_m += by, 1e-6),
            (CameraUnknown::DriftX, |c, by| c.drift_x_m_per_s += by, 1e-6),
            (CameraUnknown::DriftDrop, |c, by| c.drift_drop_m_per_s += by, 1e-6),
            (CameraUnknown::Scale, |c, by| c.scale += by, 1e-5),
            (CameraUnknown::Tilt, |c, by| c.tilt_rad += by, 1e-5),
            (CameraUnknown::Curvature, |c, by| c.curvature_per_m += by, 1e-4),
        ];
        for (tilt, curvature) in [(0.3, 8.0), (-0.04, 0.9), (0.01, 0.0)] {
            for seen_head_m in [None, Some(0.049)] {
                let camera = camera(tilt, curvature);
                let picture = |camera: CameraParameters, means: [f64; 4]| {
                    PictureGeometry::new(camera, UPRIGHT_M, CENTRE_M)
                        .project_frame(seen_head_m, 0.1, means)
                        .picture()
                };
                let geometry = PictureGeometry::new(camera, UPRIGHT_M, CENTRE_M);
                let shown = geometry.project_frame(seen_head_m, 0.1, MEANS);
                let check = |what: String, exact: [f64; 2], step: f64, near: &dyn Fn(f64) -> [f64; 2]| {
                    let (above, below) = (near(step), near(-step));
                    for k in 0..2 {
                        let found = (above[k] - below[k]) / (2.0 * step);
                        let tolerance = 1e-7 * exact[k].abs().max(1e-3);
                        assert!((found - exact[k]).abs() < tolerance, "{what} {k}: {found} {}", exact[k]);
                    }
                };
                for (mean, exact) in shown.by_means().into_iter().enumerate() {
                    check(format!("mean {mean}"), exact, 1e-5, &|by| {
                        let mut means = MEANS;
                        means[mean] += by;
                        picture(camera, means)
                    });
                }
                for (what, change, step) in changes {
                    check(format!("{what:?}"), shown.by_camera(what), step, &|by| {
                        let mut camera = camera;
                        change(&mut camera, by);
                        picture(camera, MEANS)
                    });
                }
            }
        }
    }
}
