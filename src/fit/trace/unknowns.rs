//! Unknowns of a trace fit, without the starting states: parameters of the scene and errors of the cameras.
//! Each has a dimensionless coordinate whose size is of the order of 1.

use super::model::TraceRecording;
use super::projection::PictureGeometry;
use crate::model::parameters::name_if_in_recording;
use crate::simulate::scene::{Drive, Scene};
use portable_math as math;
use std::sync::Arc;

/// Kind of error of the camera that took a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraUnknown {
    /// Part of the distance between the markers of tip and head along the sweep, m, that neither the lean of
    /// the blade nor the place of the tip's marker on the lip explains. It comes from the marker of the head
    /// or, without one, from the zero of the picture.
    OffsetX,
    /// Offset of the drop, m: the measured drop of an upright blade.
    OffsetDrop,
    /// Distance along the lip, m, by which the tip's marker is beyond the edge of the lip. The marker turns
    /// with the lip.
    TipAlong,
    /// Distance of the tip's marker from the middle of the lip, across the lip, m; positive if, on an upright
    /// lip, the marker is at a larger position along the sweep than the middle. The marker turns with the
    /// lip.
    TipAcross,
    /// Height of the head's marker above the hinge, m. Only glass that slopes shows it: there the marker
    /// appears farther down the slope than the hinge.
    HeadAbove,
    /// Rate of change of [`Self::OffsetX`], m/s; `OffsetX` itself is the offset at the middle of the fitted
    /// frames.
    DriftX,
    /// Rate of change of [`Self::OffsetDrop`], m/s; `OffsetDrop` itself is the offset at the middle of the
    /// fitted frames.
    DriftDrop,
    /// Relative error of the scale: a metre appears as `1 + scale` metres.
    Scale,
    /// Angle from the picture's x axis to the glass, rad.
    Tilt,
    /// Curvature, 1/m, that the glass has in addition to the one that was measured on the path of the tip;
    /// positive if the middle lies lower than the ends.
    Curvature,
    /// Clock of the camera minus clock of the drive, s.
    Clock,
}

impl CameraUnknown {
    /// Camera error that corresponds to a coordinate of 1, in the SI unit of the error. It is a typical size
    /// of this error.
    pub(super) fn coordinate_unit(self) -> f64 {
        match self {
            Self::OffsetX | Self::OffsetDrop | Self::DriftX | Self::DriftDrop => 1e-4,
            Self::TipAlong | Self::TipAcross | Self::HeadAbove => 1e-4,
            Self::Scale | Self::Tilt => 1e-2,
            Self::Curvature => 0.1,
            Self::Clock => 1e-4,
        }
    }

    /// Key of the camera error in files; it ends with the unit.
    pub(crate) fn key(self) -> &'static str {
        match self {
            Self::OffsetX => "offset_x_m",
            Self::OffsetDrop => "offset_drop_m",
            Self::TipAlong => "tip_along_lip_m",
            Self::TipAcross => "tip_across_lip_m",
            Self::HeadAbove => "head_above_hinge_m",
            Self::DriftX => "drift_x_m_per_s",
            Self::DriftDrop => "drift_drop_m_per_s",
            Self::Scale => "scale_relative",
            Self::Tilt => "tilt_rad",
            Self::Curvature => "curvature_per_m",
            Self::Clock => "clock_s",
        }
    }
}

/// Kind of an unknown.
#[derive(Debug, Clone, PartialEq)]
pub enum UnknownKind {
    /// A parameter that all scenes share. Its coordinate is the logarithm of its value or, with linear
    /// bounds, the value divided by the width of the bounds.
    Parameter {
        /// Name of the parameter in the table of parameters.
        name: String,
        /// Value that corresponds to a coordinate of 1; `None` if the coordinate is the logarithm of the
        /// value.
        unit: Option<f64>,
    },
    /// An error of the camera of one recording.
    Camera {
        /// Index of the recording.
        film: usize,
        /// The error.
        what: CameraUnknown,
    },
}

/// An unknown with its range and its prior; both refer to the coordinate of the unknown, not to its value.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceUnknown {
    /// What is unknown.
    pub kind: UnknownKind,
    /// Lower and upper end of the range, in the coordinate.
    pub range: [f64; 2],
    /// Mean and standard deviation of the normal prior of the coordinate, if there is one.
    pub prior: Option<[f64; 2]>,
    /// Coordinate at which a search starts.
    pub start: f64,
}

impl TraceUnknown {
    /// For a parameter: its key in the scene file. For a camera error: the name of the recording and the key
    /// of the error. `recordings` are the names of the recordings.
    pub(crate) fn name(&self, recordings: &[String]) -> String {
        match &self.kind {
            UnknownKind::Parameter { name, .. } => name.clone(),
            UnknownKind::Camera { film, what } => {
                format!("{}: {}", recordings.get(*film).map_or("", String::as_str), what.key())
            }
        }
    }

    /// Value that corresponds to a coordinate of 1; `None` if the coordinate is the logarithm of the value.
    pub(crate) fn unit(&self) -> Option<f64> {
        match self.kind {
            UnknownKind::Parameter { unit, .. } => unit,
            UnknownKind::Camera { what, .. } => Some(what.coordinate_unit()),
        }
    }

    /// The value at a coordinate, in the SI unit of the unknown.
    pub(crate) fn value(&self, coordinate: f64) -> f64 {
        self.unit().map_or_else(|| math::exp(coordinate), |unit| coordinate * unit)
    }

    /// The coordinate of a value that is given in the SI unit of the unknown.
    pub(crate) fn coordinate(&self, value: f64) -> f64 {
        self.unit().map_or_else(|| math::ln(value), |unit| value / unit)
    }

    /// Derivative of the value with respect to the coordinate, at `coordinate`.
    pub(crate) fn slope(&self, coordinate: f64) -> f64 {
        self.unit().unwrap_or_else(|| math::exp(coordinate))
    }

    /// Distance of a coordinate from the mean of the prior, in standard deviations of the prior, and
    /// derivative of this distance with respect to the coordinate; `None` without a prior.
    pub(super) fn prior_residual(&self, coordinate: f64) -> Option<[f64; 2]> {
        self.prior.map(|[mean, sd]| [(coordinate - mean) / sd, 1.0 / sd])
    }
}

/// All unknowns; the parameters come first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TraceUnknowns(pub Vec<TraceUnknown>);

/// Errors of a camera at one point of the search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CameraParameters {
    pub offset_x_m: f64,
    pub offset_drop_m: f64,
    /// [`CameraUnknown::TipAlong`] and [`CameraUnknown::TipAcross`], m.
    pub tip_marker_m: [f64; 2],
    pub head_above_m: f64,
    pub drift_x_m_per_s: f64,
    pub drift_drop_m_per_s: f64,
    pub scale: f64,
    pub tilt_rad: f64,
    pub curvature_per_m: f64,
    pub clock_s: f64,
}

impl CameraParameters {
    /// Offsets of position and drop, m, at the time `after_s` (s) after the middle of the fitted frames.
    pub(crate) fn offsets_m(&self, after_s: f64) -> [f64; 2] {
        [
            self.offset_x_m + self.drift_x_m_per_s * after_s,
            self.offset_drop_m + self.drift_drop_m_per_s * after_s,
        ]
    }
}

impl TraceUnknowns {
    /// Whether unknown `i` is a parameter of the scene.
    pub(super) fn is_parameter(&self, i: usize) -> bool {
        matches!(self.0[i].kind, UnknownKind::Parameter { .. })
    }

    /// Indices of the parameters of the scene.
    pub(crate) fn parameters(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.0.len()).filter(|&i| self.is_parameter(i))
    }

    /// Index of the parameter of the scene with this name.
    pub(crate) fn position(&self, name: &str) -> Option<usize> {
        (0..self.0.len()).find(|&i| self.parameter_name(i) == Some(name))
    }

    /// Whether unknown `i` is a constant: a parameter of the scene that starts at the mean of its prior.
    pub(crate) fn is_constant(&self, i: usize) -> bool {
        let unknown = &self.0[i];
        self.is_parameter(i) && unknown.prior.is_some_and(|[mean, _]| mean == unknown.start)
    }

    /// Name of unknown `i`, if it is a parameter of the scene.
    pub(super) fn parameter_name(&self, i: usize) -> Option<&str> {
        match &self.0[i].kind {
            UnknownKind::Parameter { name, .. } => Some(name),
            UnknownKind::Camera { .. } => None,
        }
    }

    /// Errors of the camera of a recording at a point; errors that are not estimated are 0.
    pub(crate) fn camera_at(&self, film: usize, point: &[f64]) -> CameraParameters {
        let value = |what| {
            let kind = UnknownKind::Camera { film, what };
            let found = self.0.iter().zip(point).find(|(unknown, _)| unknown.kind == kind);
            found.map_or(0.0, |(unknown, z)| unknown.value(*z))
        };
        CameraParameters {
            offset_x_m: value(CameraUnknown::OffsetX),
            offset_drop_m: value(CameraUnknown::OffsetDrop),
            tip_marker_m: [value(CameraUnknown::TipAlong), value(CameraUnknown::TipAcross)],
            head_above_m: value(CameraUnknown::HeadAbove),
            drift_x_m_per_s: value(CameraUnknown::DriftX),
            drift_drop_m_per_s: value(CameraUnknown::DriftDrop),
            scale: value(CameraUnknown::Scale),
            tilt_rad: value(CameraUnknown::Tilt),
            curvature_per_m: value(CameraUnknown::Curvature),
            clock_s: value(CameraUnknown::Clock),
        }
    }

    /// The scene of a recording at a point; `None` if the scene refuses a value.
    pub(crate) fn scene_at(&self, shoot: &TraceRecording, film: usize, point: &[f64]) -> Option<Scene> {
        let mut scene = shoot.scene.clone();
        for (unknown, z) in self.0.iter().zip(point) {
            if let UnknownKind::Parameter { name, .. } = &unknown.kind
                && let Some(name) = name_if_in_recording(name, shoot.condition)
            {
                scene = scene.with_parameter(name, unknown.value(*z)).ok()?;
            }
        }
        if let Some(curve) = &shoot.observation.own_curve {
            let geometry = self.geometry_at(shoot, film, point, &scene);
            let place_m = |seen_m: f64| shoot.observation.centre_m + geometry.locate_head(seen_m);
            scene.drive = Drive::Recorded(Arc::new(curve.map_positions(place_m)));
        }
        Some(scene)
    }

    /// The camera of a recording at a point, and the blade of `scene` that it films.
    pub(super) fn geometry_at(
        &self,
        shoot: &TraceRecording,
        film: usize,
        point: &[f64],
        scene: &Scene,
    ) -> PictureGeometry {
        let upright_m = scene.linkage.upright_height_m();
        PictureGeometry::new(self.camera_at(film, point), upright_m, shoot.observation.centre_m)
    }

    /// A point of the unknowns `from` in these unknowns. Unknowns that only `self` has are taken from
    /// `start`.
    pub(crate) fn carry_point(&self, start: &[f64], from: &Self, point: &[f64]) -> Vec<f64> {
        let carry = |(unknown, start): (&TraceUnknown, &f64)| {
            let found = from.0.iter().zip(point).find(|(old, _)| old.kind == unknown.kind);
            found.map_or(*start, |(_, z)| z.clamp(unknown.range[0], unknown.range[1]))
        };
        self.0.iter().zip(start).map(carry).collect()
    }

    /// Cost of the priors at a point: the sum of their squared residuals.
    pub(crate) fn prior_cost(&self, point: &[f64]) -> f64 {
        let residuals = self.0.iter().zip(point).filter_map(|(unknown, z)| unknown.prior_residual(*z));
        residuals.map(|[residual, _]| residual * residual).sum()
    }

    /// The point, clamped to the ranges of the unknowns.
    pub(super) fn clamp_to_ranges(&self, point: &[f64]) -> Vec<f64> {
        self.0.iter().zip(point).map(|(u, z)| z.clamp(u.range[0], u.range[1])).collect()
    }
}
