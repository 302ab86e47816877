//! What a first job does with each number of a blade.

/// What becomes of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParameterRole {
    /// The user measures it on the blade, to this relative standard deviation: it is held there, or freed
    /// within it where it is a constant that a fit may free.
    Yours(Option<f64>),
    /// Nobody knows it well before a fit: freed within this relative standard deviation around the example.
    Guessed(f64),
    /// What the fit is for: free between two bounds.
    Fitted([f64; 2]),
    /// Free between these multiples of one over the greatest speed of the head.
    FittedOverSpeed([f64; 2]),
}

// Bounds are about a decade wide: wider ones led searches from other places than the middle nowhere.

/// Rubber on wet glass at rest, less what stays at speed.
const FALLING: [f64; 2] = [0.03, 0.6];
/// What stays at speed.
const STAYING: [f64; 2] = [0.1, 0.8];
/// Friction that falls over an eighth of the greatest speed, or over five times as much: what is outside
/// shows as a constant.
const DECAY: [f64; 2] = [0.2, 8.0];
/// About the 195 Hz of the paper's blade.
const NECK_HZ: [f64; 2] = [60.0, 600.0];
/// From a shoulder that is hardly felt to one that is as good as rigid.
const SHOULDER: [f64; 2] = [4.0, 60.0];
/// A part that was weighed or computed from its cross section.
const WEIGHED: ParameterRole = ParameterRole::Yours(Some(0.05));
/// Read from a scale below the blade.
const PRELOAD: ParameterRole = ParameterRole::Yours(Some(0.05));
/// Measured on a picture of the cross section; a fit holds lengths.
const MEASURED: ParameterRole = ParameterRole::Yours(None);
/// A natural frequency or an angle of a blade of the same kind.
const SIMILAR: ParameterRole = ParameterRole::Guessed(0.2);
/// The widest that a constant may be freed: dampings of rubber differ by a factor.
const UNKNOWN: ParameterRole = ParameterRole::Guessed(0.5);

/// Every number of the example's blade, shoulder and friction in the form in which a draft writes it.
pub const PARAMETER_PLAN: [(&str, ParameterRole); 21] = [
    ("blade.head_mass_kg", WEIGHED),
    ("blade.neck_mass_kg", WEIGHED),
    ("blade.lip_mass_kg", WEIGHED),
    ("blade.neck_length_m", MEASURED),
    ("blade.lip_length_m", MEASURED),
    ("blade.neck_centre_m", MEASURED),
    ("blade.lip_centre_m", MEASURED),
    ("blade.neck_inertia_kg_m2", WEIGHED),
    ("blade.lip_inertia_kg_m2", WEIGHED),
    ("blade.preload_force_n", PRELOAD),
    ("blade.head_natural_frequency_hz", SIMILAR),
    ("blade.neck_natural_frequency_hz", ParameterRole::Fitted(NECK_HZ)),
    ("blade.lip_natural_frequency_hz", SIMILAR),
    ("blade.head_damping_ratio", UNKNOWN),
    ("blade.neck_damping_ratio", UNKNOWN),
    ("blade.lip_damping_ratio", UNKNOWN),
    ("shoulder.contact_angle_rad", SIMILAR),
    ("shoulder.stiffness_ratio", ParameterRole::Fitted(SHOULDER)),
    ("friction.a", ParameterRole::Fitted(FALLING)),
    ("friction.b_s_per_m", ParameterRole::FittedOverSpeed(DECAY)),
    ("friction.c", ParameterRole::Fitted(STAYING)),
];

/// The numbers of a blade with or without a shoulder.
pub(super) fn plan_parameters(shoulder: bool) -> impl Iterator<Item = (&'static str, ParameterRole)> {
    PARAMETER_PLAN.into_iter().filter(move |(name, _)| shoulder || !name.starts_with("shoulder."))
}
