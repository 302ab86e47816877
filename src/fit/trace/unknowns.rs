//! What a trace fit estimates besides starting states: parameters of the scene and what is not known of the
//! cameras, each along a coordinate of order one.

use crate::math;
use crate::simulate::scene::Scene;

/// What is not known of the camera that took a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraUnknown {
    /// Place of the tip's marker against the head's along the sweep, m, beyond the blade's own lean.
    OffsetX,
    /// Height of the head's marker: what is read as drop of the upright blade, m.
    OffsetDrop,
    /// Speed of the first of these, m/s: it is 0 in the middle of the fitted frames.
    DriftX,
    /// Speed of the second, m/s, likewise.
    DriftDrop,
    /// Relative error of the scale: a metre appears as `1 + scale` metres.
    Scale,
    /// Angle from the picture's x axis to the glass, rad.
    Tilt,
    /// How much later the camera's clock reads than the drive's, s.
    Clock,
}

impl CameraUnknown {
    /// Size of a unit of the coordinate: of the order of what is found.
    pub(super) fn coordinate_unit(self) -> f64 {
        match self {
            Self::OffsetX | Self::OffsetDrop | Self::DriftX | Self::DriftDrop => 1e-4,
            Self::Scale | Self::Tilt => 1e-2,
            Self::Clock => 1e-4,
        }
    }
}

/// What an unknown is.
#[derive(Debug, Clone, PartialEq)]
pub enum UnknownKind {
    /// A parameter of every scene by name; searched in its logarithm or in units of its range.
    Parameter {
        /// Name in the table of parameters.
        name: String,
        /// Length of a unit of the coordinate; `None` for its logarithm.
        unit: Option<f64>,
    },
    /// Something of the camera of one recording.
    Camera {
        /// Number of the recording.
        film: usize,
        what: CameraUnknown,
    },
}

/// An unknown with its range and what is known beforehand, in its coordinate.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceUnknown {
    pub kind: UnknownKind,
    /// Lower and upper end of the range, in the coordinate.
    pub range: [f64; 2],
    /// Mean and standard deviation of its normal prior, in the coordinate.
    pub prior: Option<[f64; 2]>,
    /// Where a search starts, in the coordinate.
    pub start: f64,
}

impl TraceUnknown {
    /// The quantity at a coordinate, in its SI unit.
    pub(crate) fn value(&self, coordinate: f64) -> f64 {
        match &self.kind {
            UnknownKind::Parameter { unit: None, .. } => math::exp(coordinate),
            UnknownKind::Parameter { unit: Some(unit), .. } => coordinate * unit,
            UnknownKind::Camera { what, .. } => coordinate * what.coordinate_unit(),
        }
    }

    /// The coordinate of a value in its SI unit.
    pub(crate) fn coordinate(&self, value: f64) -> f64 {
        match &self.kind {
            UnknownKind::Parameter { unit: None, .. } => math::ln(value),
            UnknownKind::Parameter { unit: Some(unit), .. } => value / unit,
            UnknownKind::Camera { what, .. } => value / what.coordinate_unit(),
        }
    }

    /// Derivative of the value by the coordinate.
    pub(crate) fn slope(&self, coordinate: f64) -> f64 {
        match &self.kind {
            UnknownKind::Parameter { unit: None, .. } => math::exp(coordinate),
            UnknownKind::Parameter { unit: Some(unit), .. } => *unit,
            UnknownKind::Camera { what, .. } => what.coordinate_unit(),
        }
    }

    /// Distance from the prior's mean and its weight, both in standard deviations.
    pub(super) fn prior_residual(&self, coordinate: f64) -> Option<[f64; 2]> {
        self.prior.map(|[mean, sd]| [(coordinate - mean) / sd, 1.0 / sd])
    }
}

/// All unknowns in order: parameters first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TraceUnknowns(pub Vec<TraceUnknown>);

/// What the camera makes of places, at one point of the search.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct CameraParameters {
    pub offset_x_m: f64,
    pub offset_drop_m: f64,
    pub drift_x_m_per_s: f64,
    pub drift_drop_m_per_s: f64,
    pub scale: f64,
    pub tilt_rad: f64,
    pub clock_s: f64,
}

impl CameraParameters {
    /// What the markers read too much along the sweep and as drop, m, so long after the middle.
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

    /// The camera of a recording at a point.
    pub(super) fn camera_at(&self, film: usize, point: &[f64]) -> CameraParameters {
        let mut view = CameraParameters::default();
        for (unknown, z) in self.0.iter().zip(point) {
            if let UnknownKind::Camera { film: of, what } = unknown.kind
                && of == film
            {
                let value = unknown.value(*z);
                match what {
                    CameraUnknown::OffsetX => view.offset_x_m = value,
                    CameraUnknown::OffsetDrop => view.offset_drop_m = value,
                    CameraUnknown::DriftX => view.drift_x_m_per_s = value,
                    CameraUnknown::DriftDrop => view.drift_drop_m_per_s = value,
                    CameraUnknown::Scale => view.scale = value,
                    CameraUnknown::Tilt => view.tilt_rad = value,
                    CameraUnknown::Clock => view.clock_s = value,
                }
            }
        }
        view
    }

    /// The scene of a recording at a point; `None` where it refuses a value.
    pub(super) fn scene_at(&self, base: &Scene, own_head: bool, film: usize, point: &[f64]) -> Option<Scene> {
        let mut scene = base.clone();
        for (unknown, z) in self.0.iter().zip(point) {
            if let UnknownKind::Parameter { name, .. } = &unknown.kind {
                scene = scene.with_parameter(name, unknown.value(*z)).ok()?;
            }
        }
        if own_head {
            scene.drive = scene.drive.scale_lengths(1.0 / (1.0 + self.camera_at(film, point).scale));
        }
        Some(scene)
    }

    /// Cost of the priors.
    pub(super) fn prior_cost(&self, point: &[f64]) -> f64 {
        self.0
            .iter()
            .zip(point)
            .filter_map(|(unknown, z)| unknown.prior_residual(*z))
            .map(|[residual, _]| residual * residual)
            .sum()
    }

    /// A point moved into the ranges.
    pub(super) fn clamp_to_ranges(&self, point: &[f64]) -> Vec<f64> {
        self.0.iter().zip(point).map(|(u, z)| z.clamp(u.range[0], u.range[1])).collect()
    }
}
