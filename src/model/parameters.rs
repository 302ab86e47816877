//! The table of a scene's numbers: name, symbol, unit, admissible range, scale and meaning.
//!
//! Files, messages, fits and reports read this table. Where a quantity can be written in two ways (a
//! stiffness or a natural frequency), both rows have the same [`ParameterQuantity`], and a scene gives
//! exactly one of them.

use super::shoulder::Shoulder;
use super::{Linkage, Spring};
use crate::text::join_with_and;
use ParameterRange::{NotNegative, Positive, Within};
use portable_math as math;
use std::f64::consts::TAU;

/// Admissible values of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParameterRange {
    /// Above zero.
    Positive,
    /// Zero or above.
    NotNegative,
    /// Between two limits, both included.
    Within(f64, f64),
}

impl ParameterRange {
    /// Whether a value is admissible; infinities and NaN are not.
    #[must_use]
    pub fn admits(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Positive => value > 0.0,
                Self::NotNegative => value >= 0.0,
                Self::Within(least, most) => (least..=most).contains(&value),
            }
    }

    /// The lowest admissible value; `None` if every value above 0 is admissible.
    pub(crate) fn lowest(self) -> Option<f64> {
        match self {
            Self::Positive => None,
            Self::NotNegative => Some(0.0),
            Self::Within(least, _) => Some(least),
        }
    }

    /// The range in words.
    pub(crate) fn describe(self) -> String {
        match self {
            Self::Positive => "a number above 0".to_owned(),
            Self::NotNegative => "a number of 0 or more".to_owned(),
            Self::Within(least, most) => format!("a number from {least} to {most}"),
        }
    }
}

/// Scale of the steps of a search along a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterScale {
    /// Steps multiply the value.
    Log,
    /// Steps add to the value.
    Linear,
}

/// The physical quantity that a parameter describes; several parameters may describe the same quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // the rows of the table describe each of them
pub enum ParameterQuantity {
    HeadMass,
    NeckMass,
    LipMass,
    NeckLength,
    LipLength,
    NeckCentre,
    LipCentre,
    NeckInertia,
    LipInertia,
    HeadStiffness,
    NeckStiffness,
    LipStiffness,
    HeadDamping,
    NeckDamping,
    LipDamping,
    Preload,
    ShoulderAngle,
    ShoulderStiffness,
    ShoulderDamping,
    FrictionA,
    FrictionB,
    FrictionC,
    FrictionLimit,
    CoulombLevel,
    StribeckSpeed,
    StribeckExponent,
    RationalDecay,
    StaticRatio,
    ViscousFriction,
    BackwardRatio,
    DriveAmplitude,
    DriveFrequency,
    DriveSpeed,
    Restitution,
    SliderMass,
    SliderStiffness,
    SliderDamping,
    NormalForce,
}

/// One row of the table of parameters.
#[derive(Debug, Clone, Copy)]
pub struct ModelParameter {
    /// Name: the scene's table and key.
    pub name: &'static str,
    /// Symbol in the paper.
    pub symbol: &'static str,
    /// Unit as shown to users.
    pub unit: &'static str,
    /// Physical quantity; if it can be written in two ways, two rows have the same quantity.
    pub quantity: ParameterQuantity,
    /// Default value of the quantity; `None` if a scene must give it.
    pub default: Option<f64>,
    /// Admissible values.
    pub range: ParameterRange,
    /// Scale of the steps of a search.
    pub scale: ParameterScale,
    /// Meaning in words.
    pub meaning: &'static str,
}

macro_rules! table {
    ($(
        $name:literal $symbol:literal $unit:literal $quantity:ident
        $default:expr, $range:expr, $scale:ident, $meaning:literal;
    )*) => {
        /// Every number of a scene that a file may set and that a fit may vary.
        pub const PARAMETERS: &[ModelParameter] = &[$(ModelParameter {
            name: $name, symbol: $symbol, unit: $unit, quantity: ParameterQuantity::$quantity,
            default: $default, range: $range, scale: ParameterScale::$scale, meaning: $meaning,
        }),*];
    };
}

/// Upper limit of the contact angle of a shoulder, rad: at this angle the neck would be horizontal.
const RIGHT_ANGLE: f64 = std::f64::consts::FRAC_PI_2;

table! {
    "blade.head_mass_kg" "m0" "kg" HeadMass None, NotNegative, Log, "mass of the head";
    "blade.neck_mass_kg" "m1" "kg" NeckMass None, NotNegative, Log, "mass of the neck";
    "blade.lip_mass_kg" "m2" "kg" LipMass None, Positive, Log, "mass of the lip";
    "blade.neck_length_m" "l1" "m" NeckLength None, Positive, Log, "length of the neck";
    "blade.lip_length_m" "l2" "m" LipLength None, Positive, Log, "length of the lip";
    "blade.neck_centre_m" "g1" "m" NeckCentre None, NotNegative, Linear, "neck: upper hinge to centre of mass";
    "blade.lip_centre_m" "g2" "m" LipCentre None, NotNegative, Linear, "lip: upper hinge to centre of mass";
    "blade.neck_inertia_kg_m2" "J1" "kg m2" NeckInertia None, NotNegative, Log, "inertia of the neck about its centre of mass";
    "blade.lip_inertia_kg_m2" "J2" "kg m2" LipInertia None, NotNegative, Log, "inertia of the lip about its centre of mass";
    "blade.head_stiffness_n_per_m" "k0" "N/m" HeadStiffness None, Positive, Log, "stiffness of the head's support";
    "blade.head_natural_frequency_hz" "f0" "Hz" HeadStiffness None, Positive, Log, "natural frequency of the head, sqrt(k0/M)/2 pi";
    "blade.neck_stiffness_n_m_per_rad" "k1" "N m/rad" NeckStiffness None, Positive, Log, "stiffness of the neck off the shoulder";
    "blade.neck_natural_frequency_hz" "f1" "Hz" NeckStiffness None, Positive, Log, "natural frequency of the neck off the shoulder, sqrt(k1/m_theta)/2 pi";
    "blade.lip_stiffness_n_m_per_rad" "k2" "N m/rad" LipStiffness None, Positive, Log, "stiffness of the lip";
    "blade.lip_natural_frequency_hz" "f2" "Hz" LipStiffness None, Positive, Log, "natural frequency of the lip, sqrt(k2/m_phi)/2 pi";
    "blade.head_damping_n_s_per_m" "c0" "N s/m" HeadDamping Some(0.0), NotNegative, Log, "damping of the head's support";
    "blade.head_damping_ratio" "z0" "1" HeadDamping Some(0.0), NotNegative, Log, "damping ratio of the head, c0/(2 sqrt(k0 M))";
    "blade.neck_damping_n_m_s_per_rad" "c1" "N m s/rad" NeckDamping Some(0.0), NotNegative, Log, "damping of the neck";
    "blade.neck_damping_ratio" "z1" "1" NeckDamping Some(0.0), NotNegative, Log, "damping ratio of the neck, c1/(2 sqrt(k1 m_theta))";
    "blade.lip_damping_n_m_s_per_rad" "c2" "N m s/rad" LipDamping Some(0.0), NotNegative, Log, "damping of the lip";
    "blade.lip_damping_ratio" "z2" "1" LipDamping Some(0.0), NotNegative, Log, "damping ratio of the lip, c2/(2 sqrt(k2 m_phi))";
    "blade.preload_displacement_m" "hd" "m" Preload None, NotNegative, Log, "how far the support is pressed down";
    "blade.preload_force_n" "k0 hd" "N" Preload None, NotNegative, Log, "force of the tip on the glass when upright";
    "shoulder.contact_angle_rad" "theta_s" "rad" ShoulderAngle None, Within(0.0, RIGHT_ANGLE), Linear, "neck angle at which it meets the shoulder";
    "shoulder.stiffness_n_m_per_rad" "ks" "N m/rad" ShoulderStiffness None, Positive, Log, "stiffness that the shoulder adds to the neck";
    "shoulder.stiffness_ratio" "ks/k1" "1" ShoulderStiffness None, Positive, Log, "ratio of the stiffness that the shoulder adds to the neck's";
    "shoulder.damping_n_m_s_per_rad" "cs" "N m s/rad" ShoulderDamping Some(0.0), NotNegative, Log, "damping that the shoulder adds";
    "shoulder.damping_ratio" "zs" "1" ShoulderDamping Some(0.0), NotNegative, Log, "damping ratio of the shoulder, cs/(2 sqrt(ks m_theta))";
    "friction.a" "A" "1" FrictionA None, NotNegative, Linear, "part of the friction coefficient that falls with speed";
    "friction.b_s_per_m" "B" "s/m" FrictionB None, NotNegative, Log, "decay of friction with speed";
    "friction.c" "C" "1" FrictionC None, NotNegative, Linear, "part of the friction coefficient that stays";
    "friction.limit_at_zero" "mu0" "1" FrictionLimit None, NotNegative, Linear, "friction coefficient of slip at zero speed";
    "friction.coulomb_level" "muC" "1" CoulombLevel None, NotNegative, Linear, "friction coefficient that a Stribeck law approaches at high speed";
    "friction.stribeck_speed_m_per_s" "vS" "m/s" StribeckSpeed None, Positive, Log, "speed at which the falling part of a Stribeck law is down to 1/e";
    "friction.stribeck_exponent" "n" "1" StribeckExponent None, Within(0.25, 4.0), Linear, "exponent of the speed in a Stribeck law";
    "friction.rational_s_per_m" "R" "s/m" RationalDecay None, NotNegative, Log, "decay of a rational law with speed";
    "friction.static_ratio" "rs" "1" StaticRatio Some(1.0), Within(1.0, 10.0), Linear, "ratio of the limit at rest to the friction of slip at zero speed";
    "friction.viscous_s_per_m" "V" "s/m" ViscousFriction Some(0.0), NotNegative, Linear, "rise of friction with speed";
    "friction.backward_ratio" "rb" "1" BackwardRatio Some(1.0), Positive, Log, "ratio of friction towards -v to friction towards +v";
    "drive.amplitude_m" "a" "m" DriveAmplitude None, Positive, Log, "half the stroke of the head";
    "drive.frequency_hz" "f" "Hz" DriveFrequency None, Positive, Log, "strokes there and back a second";
    "drive.speed_m_per_s" "vd" "m/s" DriveSpeed None, Within(-100.0, 100.0), Linear, "constant speed of the head";
    "contact.restitution" "e" "1" Restitution Some(0.0), Within(0.0, 1.0), Linear, "normal restitution of a landing";
    "slider.mass_kg" "m" "kg" SliderMass None, Positive, Log, "mass of the slider";
    "slider.stiffness_n_per_m" "k" "N/m" SliderStiffness None, NotNegative, Log, "stiffness of the spring between head and slider";
    "slider.damping_n_s_per_m" "d" "N s/m" SliderDamping Some(0.0), NotNegative, Log, "damping between head and slider";
    "slider.normal_force_n" "N" "N" NormalForce None, Positive, Log, "constant force of the slider on the surface";
}

/// Finds the row of the parameter with this name; a number of a recording in the name has no effect.
#[must_use]
pub fn find_parameter(name: &str) -> Option<&'static ModelParameter> {
    let name = name_in_scene(name);
    PARAMETERS.iter().find(|p| p.name == name)
}

/// Sign between the name of a parameter and the number of the recording in which it has its own value, as in
/// `friction.c@2`.
const OF_RECORDING: char = '@';

/// Name of the parameter that has its own value in the recording with this index.
pub(crate) fn name_in_recording(name: &str, recording: usize) -> String {
    format!("{name}{OF_RECORDING}{}", recording + 1)
}

/// Key in the scene file of a parameter, without the number of a recording.
pub(crate) fn name_in_scene(name: &str) -> &str {
    name.split(OF_RECORDING).next().unwrap_or(name)
}

/// Key in the scene file of a parameter, if it has a value in the recording with this index.
pub(crate) fn name_if_in_recording(name: &str, recording: usize) -> Option<&str> {
    let (key, number) = name.split_once(OF_RECORDING).unwrap_or((name, ""));
    (number.is_empty() || number.parse() == Ok(recording + 1)).then_some(key)
}

/// Symbol of a parameter in the equations, with the number of the recording in which it has its own value, as
/// in `C@2`; `None` if there is no such parameter.
pub(crate) fn symbol_with_recording(name: &str) -> Option<String> {
    let number = &name[name_in_scene(name).len()..];
    find_parameter(name).map(|row| format!("{}{number}", row.symbol))
}

/// Names of all parameters, in the order of the table.
#[must_use]
pub fn parameter_names() -> Vec<&'static str> {
    PARAMETERS.iter().map(|p| p.name).collect()
}

/// Parameters and camera errors in words, such as "natural frequency of the lip, A and C of the friction
/// law". Only the part of a meaning before its first comma is taken, so that lists stay readable. Any other
/// name is repeated as it is.
pub(crate) fn describe_parameters<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let (of_law, others): (Vec<&str>, Vec<&str>) =
        names.into_iter().partition(|name| name.starts_with("friction.") && find_parameter(name).is_some());
    let camera = |name| CAMERA_ERRORS.iter().find(|(key, _)| *key == name).map(|(_, words)| *words);
    let meaning = |name| find_parameter(name).and_then(|row| row.meaning.split(',').next()).or(camera(name));
    let mut words: Vec<String> = others.iter().map(|name| meaning(name).unwrap_or(name).to_owned()).collect();
    words.extend(of_law.iter().filter_map(|name| symbol_with_recording(name)));
    let law = if of_law.is_empty() { "" } else { " of the friction law" };
    join_with_and(&words) + law
}

/// Errors of a camera that a fit estimates, each with its meaning.
const CAMERA_ERRORS: [(&str, &str); 11] = [
    ("tilt_rad", "tilt of the camera"),
    ("scale_relative", "scale of the camera"),
    ("offset_x_m", "offset of the camera along the sweep"),
    ("offset_drop_m", "offset of the camera in height"),
    ("drift_x_m_per_s", "drift of the tracked point along the sweep"),
    ("drift_drop_m_per_s", "drift of the tracked point in height"),
    ("curvature_per_m", "curvature of the glass"),
    ("tip_along_lip_m", "distance of the tracked point along the lip"),
    ("tip_across_lip_m", "distance of the tracked point across the lip"),
    ("head_above_hinge_m", "height of the tracked point above the hinge of the head"),
    ("clock_s", "clock of the camera"),
];

/// Natural frequency `sqrt(stiffness / inertia) / (2 pi)`, Hz.
pub(crate) fn natural_frequency_hz(stiffness: f64, inertia: f64) -> f64 {
    (stiffness / inertia).sqrt() / TAU
}

/// Stiffness of a spring with which a mass or a moment of inertia has the natural frequency `frequency_hz`.
pub(crate) fn stiffness_from_frequency(frequency_hz: f64, inertia: f64) -> f64 {
    inertia * math::powi(TAU * frequency_hz, 2)
}

/// Damping constant that gives a damping ratio: `ratio` times the critical damping
/// `2 * sqrt(stiffness * inertia)`.
pub(crate) fn damping_from_ratio(ratio: f64, stiffness: f64, inertia: f64) -> f64 {
    2.0 * ratio * (stiffness * inertia).sqrt()
}

/// Value of the parameter `name`, computed from a blade whose scene may have given an equivalent parameter
/// instead, such as a natural frequency for a stiffness. `None` for a parameter without an equivalent, or for
/// a part that the blade lacks.
pub(crate) fn convert_value(name: &str, blade: &Linkage) -> Option<f64> {
    let (mass, theta, phi) = (blade.mass_kg, blade.m_theta, blade.m_phi);
    let (table, key) = name.split_once('.')?;
    if let Some(slider) = blade.slider() {
        return (name == "slider.damping_n_s_per_m").then_some(slider.spring.damping);
    }
    let (part, kind) = if table == "shoulder" { (table, key) } else { key.split_once('_')? };
    let (Spring { stiffness, damping }, inertia) = match part {
        "head" | "preload" => (blade.head, mass),
        "neck" => (blade.neck, theta),
        "lip" => (blade.lip, phi),
        "shoulder" => {
            let Shoulder { stiffness_n_m_per_rad: stiffness, damping_n_m_s_per_rad: damping, .. } =
                blade.shoulder?;
            (Spring { stiffness, damping }, theta)
        }
        _ => return None,
    };
    match kind {
        "stiffness_n_per_m" | "stiffness_n_m_per_rad" => Some(stiffness),
        "stiffness_ratio" => Some(stiffness / blade.neck.stiffness),
        "natural_frequency_hz" => Some(natural_frequency_hz(stiffness, inertia)),
        "damping_n_s_per_m" | "damping_n_m_s_per_rad" => Some(damping),
        "damping_ratio" => Some(damping / damping_from_ratio(1.0, stiffness, inertia)),
        "displacement_m" => Some(blade.preload_displacement_m),
        "force_n" => Some(blade.preload_displacement_m * stiffness),
        _ => None,
    }
}

/// Advice on the length of blade to which the numbers of a scene apply. The solution of the equations of
/// motion does not change if all these numbers are multiplied by one factor, so any length of blade will do.
pub(crate) const SAME_LENGTH_ADVICE: &str = "Masses, inertias, stiffnesses, dampings and the preload are all for one and \
                               the same length of blade: the whole blade, the piece on the rig, or one metre.";

impl ParameterQuantity {
    /// How the quantity is measured, in one sentence.
    pub(crate) fn measurement_method(self) -> &'static str {
        match self {
            Self::HeadMass => "weigh everything that moves with the head: upper profile, spring strip, claws",
            Self::NeckMass => "density times cross section times length of blade, or weigh a neck cut free",
            Self::LipMass => "density times cross section times length of blade, or weigh a lip cut free",
            Self::NeckLength => {
                "on a picture of the cross section: from where the neck bends below the head to where the lip \
                 bends"
            }
            Self::LipLength => "on a picture of the cross section: from where the lip bends to its edge",
            Self::NeckCentre | Self::LipCentre => {
                "on the cross section, from the upper hinge; half the length if the part is a rectangle, 0.4 \
                 of it for a lip that tapers"
            }
            Self::NeckInertia | Self::LipInertia => {
                "from the cross section: m (length^2 + thickness^2)/12 for a rectangle, m length^2/18 for a \
                 triangle"
            }
            Self::HeadStiffness => {
                "push the head towards the glass and read force over way, or let it ring without the blade \
                 on the glass and read the frequency"
            }
            Self::NeckStiffness => {
                "bend the neck by a known torque, or flick the lip off the glass and read the lower frequency \
                 that rings"
            }
            Self::LipStiffness => {
                "hold the neck, bend the lip by a known torque, or flick it and read the frequency that rings"
            }
            Self::HeadDamping | Self::NeckDamping | Self::LipDamping => {
                "from a ring-down: ln(amplitude ratio of neighbouring cycles)/2 pi is the damping ratio"
            }
            Self::Preload => "the force on the glass with the head at rest, from a scale below the blade",
            Self::ShoulderAngle => {
                "on a picture of the cross section: how far the neck turns until it touches the shoulder"
            }
            Self::ShoulderStiffness => {
                "bend the neck beyond the shoulder by a known torque: what it is stiffer than before"
            }
            Self::ShoulderDamping => "from a ring-down on the shoulder; leave it out where it is not known",
            Self::FrictionA | Self::FrictionB | Self::FrictionC => {
                "side force over normal force at several steady speeds gives A exp(-B |v|) + C"
            }
            Self::FrictionLimit
            | Self::CoulombLevel
            | Self::StribeckSpeed
            | Self::StribeckExponent
            | Self::RationalDecay
            | Self::ViscousFriction => "from side force over normal force at several steady speeds",
            Self::StaticRatio => {
                "side force at the release after a rest, over side force at the lowest steady speed"
            }
            Self::BackwardRatio => "side force at the same steady speed in both directions",
            Self::DriveAmplitude => "half the way of the head from one end of the stroke to the other",
            Self::DriveSpeed => "from the positions of the head over time",
            Self::DriveFrequency => "one over the time of a stroke there and back",
            Self::Restitution => "0 for a lip that does not bounce",
            Self::SliderMass => "weigh everything that moves with the slider",
            Self::SliderStiffness => {
                "lift the slider off the surface, pull it, and divide the force by the displacement"
            }
            Self::SliderDamping => {
                "let it ring off the surface: twice the mass times the rate of decay of the amplitude"
            }
            Self::NormalForce => "add the load to the weight of the slider, or read a force sensor below it",
        }
    }
}
