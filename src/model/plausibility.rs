//! Plausibility of the numbers of a blade: a table of quantities, each with its expected range and the usual
//! mistakes with its unit.
//!
//! A value outside its range gives a finding, not an error: an unusual blade may have it.

use super::parameters;
use crate::text::{format_plain, round_to_digits};
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// Significant digits of a number in a finding.
const DIGITS: usize = 6;

/// A value outside the range of its quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlausibilityFinding {
    /// Table and key of the value.
    pub key: String,
    /// The value and its unit.
    pub found: String,
    /// The range and its reason.
    pub expected: String,
    /// The likeliest mistake and its correction.
    pub advice: String,
}

impl std::fmt::Display for PlausibilityFinding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { key, found, expected, advice } = self;
        write!(f, "key `{key}`: found {found}, expected {expected}; {advice}")
    }
}

/// A usual mistake with a unit.
#[derive(Debug, Clone, Copy)]
pub struct UnitSlip {
    /// Factor by which the value must be multiplied to correct the mistake.
    pub factor: f64,
    /// The mistake in words, for example "millimetres written as metres".
    pub words: &'static str,
}

/// Looks up the value of a key; `None` for a key without a value.
pub(crate) type ValueLookup<'a> = dyn Fn(&str) -> Option<f64> + 'a;

/// The number that is compared with a range.
#[derive(Debug, Clone, Copy)]
pub enum PlausibilitySubject {
    /// The value of the key.
    Value,
    /// A number computed from several keys; not judged if one of these keys has a finding.
    Derived {
        /// Name of the number, for example "the static friction A + C".
        name: &'static str,
        /// Keys that the number depends on; the first is the key of the row.
        keys: &'static [&'static str],
        /// Computes the number from the values of the keys.
        of: fn(&ValueLookup<'_>) -> Option<f64>,
    },
}

/// A row of the table of plausible ranges.
#[derive(Debug, Clone, Copy)]
pub struct PlausibleRange {
    /// Table and key of the value in a file.
    pub key: &'static str,
    /// The number that is compared with the range.
    pub judged: PlausibilitySubject,
    /// Unit of the judged number.
    pub unit: &'static str,
    /// Smallest and largest plausible value.
    pub range: [f64; 2],
    /// Reason for these limits.
    pub reason: &'static str,
    /// Possible mistakes, the likeliest first.
    pub slips: &'static [UnitSlip],
}

/// Findings on the values of a file, in the order of the table.
///
/// `written` maps the key of a row to the key under which the file gives the same quantity. If the two
/// differ, the value of the row is computed, so it is judged like a derived number.
pub(crate) fn find_implausible(
    table: &[PlausibleRange],
    value: &ValueLookup<'_>,
    written: &dyn Fn(&'static str) -> &'static str,
) -> Vec<PlausibilityFinding> {
    let mut found: Vec<PlausibilityFinding> = Vec::new();
    for row in table {
        let doubted = |key: &&str| found.iter().any(|finding| finding.key == *key);
        let (judged, rests_on_doubt) = match row.judged {
            PlausibilitySubject::Derived { keys, of, .. } => (of(value), keys.iter().any(doubted)),
            // a conversion between frequency and stiffness uses masses and lengths, so that a converted value
            // is not judged if any earlier row has a finding
            PlausibilitySubject::Value => (value(row.key), written(row.key) != row.key && !found.is_empty()),
        };
        let judged = judged.filter(|judged| !rests_on_doubt && !row.admits(*judged));
        found.extend(judged.map(|judged| row.describe_finding(judged, value, written(row.key))));
    }
    found
}

impl PlausibleRange {
    fn admits(&self, judged: f64) -> bool {
        let [least, greatest] = self.range;
        (least..=greatest).contains(&judged)
    }

    fn describe_finding(
        &self,
        judged: f64,
        value: &ValueLookup<'_>,
        key: &'static str,
    ) -> PlausibilityFinding {
        let [least, greatest] = self.range.map(format_value);
        let unit = if self.unit == "1" { String::new() } else { format!(" {}", self.unit) };
        let name = match self.judged {
            PlausibilitySubject::Derived { name, .. } => format!(" for {name}"),
            PlausibilitySubject::Value if key != self.key => {
                format!(" for {}", parameters::find_parameter(self.key).map_or(self.key, |p| p.meaning))
            }
            PlausibilitySubject::Value => String::new(),
        };
        PlausibilityFinding {
            key: key.to_owned(),
            found: format!("{}{unit}{name}", format_value(judged)),
            expected: format!("{least} to {greatest}{unit} ({})", self.reason),
            // the listed mistakes concern the unit of the row's own key
            advice: self.advise_correction(judged, value(key).filter(|_| key == self.key)),
        }
    }

    /// Advice on the likeliest mistake whose correction brings the number into its range, or general advice.
    /// A number with listed mistakes is proportional to the value of its own key.
    fn advise_correction(&self, judged: f64, written: Option<f64>) -> String {
        let slip = self.slips.iter().find(|slip| self.admits(judged * slip.factor));
        match slip.zip(written) {
            Some((slip, written)) => {
                format!("probably {}: then write {}", slip.words, format_value(written * slip.factor))
            }
            None => "check the value and its unit".to_owned(),
        }
    }
}

fn format_value(value: f64) -> String {
    format_plain(round_to_digits(value, DIGITS))
}

// Ranges that several rows of the tables share. They are wide: the values of every blade in use are within
// them.

/// Height of a link, m: the rubber of a wiper is 5 to 20 mm high, and a part that bends on its own is at
/// least 0.5 mm high.
const LINK_M: [f64; 2] = [5e-4, 2e-2];
/// Thickness of a link, m: from the edge of a lip to the widest body of a profile.
const THICKNESS_M: [f64; 2] = [1e-4, 1e-2];
/// Thickness of a hinge, m: a thinner hinge tears, and a thicker part does not act as a hinge.
const HINGE_THICKNESS_M: [f64; 2] = [1e-4, 3e-3];
/// Height of a hinge, m.
const HINGE_M: [f64; 2] = [1e-4, 5e-3];
/// Length of blade, m: from a slice on a rig to the longest blade of a bus.
const PIECE_M: [f64; 2] = [5e-3, 1.5];
/// Density of rubber, kg/m3: from pure natural rubber and EPDM (860 to 930) to highly filled chloroprene.
const DENSITY_KG_PER_M3: [f64; 2] = [850.0, 1600.0];
/// Mass of a link, kg: from the smallest section and the shortest piece to the largest section and piece.
const LINK_MASS_KG: [f64; 2] = [
    DENSITY_KG_PER_M3[0] * THICKNESS_M[0] * LINK_M[0] * PIECE_M[0],
    DENSITY_KG_PER_M3[1] * THICKNESS_M[1] * LINK_M[1] * PIECE_M[1],
];
/// Ratio of the mass of a link to its height, kg/m: density times thickness times length of blade.
const MASS_OVER_HEIGHT_KG_PER_M: [f64; 2] =
    [DENSITY_KG_PER_M3[0] * THICKNESS_M[0] * PIECE_M[0], DENSITY_KG_PER_M3[1] * THICKNESS_M[1] * PIECE_M[1]];
/// Ratio of the distance of the centre of mass from the top to the length of a link: 1/3 for a triangle with
/// its base at the top, 2/3 for one with its base at the bottom; the range leaves room for a bead at either
/// end.
const CENTRE_OVER_LENGTH: [f64; 2] = [0.2, 0.8];
/// Ratio of the moment of inertia of a link, about its centre of mass, to its mass times the square of its
/// length: 1/12 for a rod, 1/18 for a triangle, 1/4 for two masses at the ends. A link may be twice as thick
/// as it is long, which adds 1/3.
const INERTIA_OVER_ROD: [f64; 2] = [0.02, 0.6];
/// Natural frequency of the head, Hz; published values are 8.88 and 20 Hz.
const HEAD_HZ: [f64; 2] = [0.5, 200.0];
/// Damping ratio of a rubber link: half the loss factor of the rubber.
const RUBBER_RATIO: [f64; 2] = [0.0, 0.5];
/// Force on the glass per metre of blade, N/m: wiper arms press with 10 to 20 N/m.
const PRESS_N_PER_M: [f64; 2] = [1.0, 60.0];
/// Force on the glass, N: from the shortest piece to a whole blade.
const PRESS_N: [f64; 2] = [PRESS_N_PER_M[0] * PIECE_M[0], PRESS_N_PER_M[1] * PIECE_M[1]];
/// Friction coefficient of rubber on glass: 0.1 to 0.6 wet, up to 2 dry.
const FRICTION: [f64; 2] = [0.0, 2.0];

const MILLIMETRES: UnitSlip = UnitSlip { factor: 1e-3, words: "millimetres written as metres" };
const CENTIMETRES: UnitSlip = UnitSlip { factor: 1e-2, words: "centimetres written as metres" };
const METRES_TWICE: UnitSlip = UnitSlip { factor: 1e3, words: "millimetres turned into metres twice" };
const GRAMS: UnitSlip = UnitSlip { factor: 1e-3, words: "grams written as kilograms" };
const MILLIGRAMS: UnitSlip = UnitSlip { factor: 1e-6, words: "milligrams written as kilograms" };
const THOUSAND_TOO_LARGE: UnitSlip = UnitSlip { factor: 1e-3, words: "three powers of ten too many" };
const THOUSAND_TOO_SMALL: UnitSlip = UnitSlip { factor: 1e3, words: "three powers of ten too few" };
const KG_MM2: UnitSlip = UnitSlip { factor: 1e-6, words: "kg mm2 written as kg m2" };
const G_CM2: UnitSlip = UnitSlip { factor: 1e-7, words: "g cm2 written as kg m2" };
const G_MM2: UnitSlip = UnitSlip { factor: 1e-9, words: "g mm2 written as kg m2" };
const PERCENT: UnitSlip = UnitSlip { factor: 1e-2, words: "percent written as a ratio" };
const POINT: UnitSlip = UnitSlip { factor: 0.1, words: "a decimal point one place too far to the right" };
const DEGREES: UnitSlip = UnitSlip { factor: PI / 180.0, words: "degrees written as radians" };
const KILOHERTZ: UnitSlip = UnitSlip { factor: 1e3, words: "kHz written as Hz" };
const GRAM_FORCE: UnitSlip = UnitSlip { factor: 9.806_65e-3, words: "grams of a scale written as newtons" };
const MEGAPASCALS: UnitSlip = UnitSlip { factor: 1e6, words: "MPa written as Pa" };
const KILOPASCALS: UnitSlip = UnitSlip { factor: 1e3, words: "kPa written as Pa" };
const G_PER_CM3: UnitSlip = UnitSlip { factor: 1e3, words: "g/cm3 written as kg/m3" };
const G_PER_M: UnitSlip = UnitSlip { factor: 1e-3, words: "g/m written as kg/m" };
const PER_MILLIMETRE: UnitSlip = UnitSlip { factor: 1e3, words: "N/mm written as N/m" };

const LENGTHS: &[UnitSlip] = &[MILLIMETRES, CENTIMETRES, METRES_TWICE];
const MASSES: &[UnitSlip] = &[GRAMS, MILLIGRAMS];
const INERTIAS: &[UnitSlip] = &[THOUSAND_TOO_LARGE, KG_MM2, G_CM2, G_MM2, THOUSAND_TOO_SMALL];

/// Makes the rows of a table from key, unit, range, reason and usual mistakes (`UnitSlip`). The row of a
/// derived number also has its name, the other keys that it depends on, and its equation.
macro_rules! ranges {
    (@judged) => { PlausibilitySubject::Value };
    (@judged $name:literal, [$($key:literal)*], $of:expr) => {
        PlausibilitySubject::Derived { name: $name, keys: &[$($key),*], of: $of }
    };
    ($(
        $key:literal $unit:literal $range:expr, $reason:expr, $slips:expr
        $(, $name:literal, [$($other:literal)*], $of:expr)?;
    )*) => {
        &[$(PlausibleRange {
            key: $key, unit: $unit, range: $range, reason: $reason, slips: $slips,
            judged: ranges!(@judged $($name, [$key $($other)*], $of)?),
        }),*]
    };
}

/// Ratio of the moment of inertia of a link, about its centre of mass, to its mass times the square of its
/// length.
fn inertia_over_rod(value: &ValueLookup<'_>, link: &str) -> Option<f64> {
    let of = |key: &str| value(&format!("blade.{link}_{key}"));
    let length = of("length_m")?;
    Some(of("inertia_kg_m2")? / (of("mass_kg")? * length * length))
}

const LINK_WHY: &str = "the rubber of a wiper is 5 to 20 mm high, a part of it at least 0.5 mm";
const THICKNESS_WHY: &str = "a profile is 0.1 mm thick at its edge and at most 10 mm at its body";
const HINGE_WHY: &str = "thinner ones tear, larger ones are no hinge";
const MASS_WHY: &str = "density 850 to 1600 kg/m3 times the cross section times 5 mm to 1.5 m of blade";
const HEAD_WHY: &str = "10 mm of upper profile with its strip, to a blade with its arm or a carriage";
const CENTRE_WHY: &str = "half for a rectangle, a third or two thirds for a triangle";
const INERTIA_WHY: &str = "1/12 for a rod, 1/18 for a triangle, up to 1/3 more if thick";
const RUBBER_WHY: &str = "half the loss factor of rubber, which is at most about 1";
const FRICTION_WHY: &str = "rubber on glass has 0.1 to 0.6 wet and up to 2 dry";

/// Plausible ranges of the numbers of a scene.
pub const SCENE_RANGES: &[PlausibleRange] = ranges! {
    "blade.neck_length_m" "m" LINK_M, LINK_WHY, LENGTHS;
    "blade.lip_length_m" "m" LINK_M, LINK_WHY, LENGTHS;
    "blade.head_mass_kg" "kg" [1e-4, 5.0], HEAD_WHY, MASSES;
    "blade.neck_mass_kg" "kg" LINK_MASS_KG, MASS_WHY, MASSES;
    "blade.lip_mass_kg" "kg" LINK_MASS_KG, MASS_WHY, MASSES;
    "blade.neck_mass_kg" "kg/m" MASS_OVER_HEIGHT_KG_PER_M, MASS_WHY, MASSES,
        "the mass over the height of the neck", ["blade.neck_length_m"],
        |value| Some(value("blade.neck_mass_kg")? / value("blade.neck_length_m")?);
    "blade.lip_mass_kg" "kg/m" MASS_OVER_HEIGHT_KG_PER_M, MASS_WHY, MASSES,
        "the mass over the height of the lip", ["blade.lip_length_m"],
        |value| Some(value("blade.lip_mass_kg")? / value("blade.lip_length_m")?);
    "blade.neck_centre_m" "1" CENTRE_OVER_LENGTH, CENTRE_WHY, LENGTHS,
        "the centre of the neck over its length", ["blade.neck_length_m"],
        |value| Some(value("blade.neck_centre_m")? / value("blade.neck_length_m")?);
    "blade.lip_centre_m" "1" CENTRE_OVER_LENGTH, CENTRE_WHY, LENGTHS,
        "the centre of the lip over its length", ["blade.lip_length_m"],
        |value| Some(value("blade.lip_centre_m")? / value("blade.lip_length_m")?);
    "blade.neck_inertia_kg_m2" "1" INERTIA_OVER_ROD, INERTIA_WHY, INERTIAS,
        "the inertia of the neck over mass times length squared",
        ["blade.neck_mass_kg" "blade.neck_length_m"], |value| inertia_over_rod(value, "neck");
    "blade.lip_inertia_kg_m2" "1" INERTIA_OVER_ROD, INERTIA_WHY, INERTIAS,
        "the inertia of the lip over mass times length squared",
        ["blade.lip_mass_kg" "blade.lip_length_m"], |value| inertia_over_rod(value, "lip");
    "blade.head_natural_frequency_hz" "Hz" HEAD_HZ,
        "arms and rigs spring slowly; 8.88 and 20 Hz are published", &[];
    "blade.neck_natural_frequency_hz" "Hz" [20.0, 5e3],
        "195 and 519 Hz are published; a tenth to ten times of these", &[KILOHERTZ];
    "blade.lip_natural_frequency_hz" "Hz" [50.0, 5e4],
        "a tongue of rubber of 1 to 10 mm rings at 100 Hz to 10 kHz", &[KILOHERTZ];
    "blade.head_damping_ratio" "1" [0.0, 1.0], "beyond 1 a head does not ring", &[PERCENT];
    "blade.neck_damping_ratio" "1" RUBBER_RATIO, RUBBER_WHY, &[PERCENT];
    "blade.lip_damping_ratio" "1" RUBBER_RATIO, RUBBER_WHY, &[PERCENT];
    "blade.preload_force_n" "N" PRESS_N,
        "arms press with 10 to 20 N per metre, here 1 to 60, on 5 mm to 1.5 m of blade", &[GRAM_FORCE];
    "shoulder.contact_angle_rad" "rad" [5e-3, 1.0],
        "a neck that leans on its shoulder has turned by 0.3 to 57 degrees", &[DEGREES];
    "shoulder.stiffness_ratio" "1" [0.1, 1e3], "less is no shoulder, more is a wall", &[PERCENT];
    "shoulder.damping_ratio" "1" RUBBER_RATIO, RUBBER_WHY, &[PERCENT];
    "friction.a" "1" FRICTION, FRICTION_WHY, &[POINT, PERCENT];
    "friction.c" "1" FRICTION, FRICTION_WHY, &[POINT, PERCENT];
    "friction.a" "1" FRICTION, FRICTION_WHY, &[],
        "the static friction A + C", ["friction.c"],
        |value| Some(value("friction.a")? + value("friction.c")?);
    "friction.b_s_per_m" "s/m" [0.0, 1e3],
        "above 1000 friction falls within 1 mm/s, and a wiper moves at 0.1 to 2 m/s", &[THOUSAND_TOO_LARGE];
    "drive.amplitude_m" "m" [1e-3, 1.0], "half a stroke, on a rig or a bus", LENGTHS;
    "drive.frequency_hz" "Hz" [0.01, 5.0], "a wiper makes at most about 1.2 strokes a second", &[];
    "drive.amplitude_m" "m/s" [1e-4, 5.0], "a wiper's tip reaches 2 to 3 m/s", LENGTHS,
        "the top speed of the head", ["drive.frequency_hz"],
        |value| Some(TAU * value("drive.amplitude_m")? * value("drive.frequency_hz")?);
};

/// Plausible ranges of the numbers of a blade's section.
pub const SECTION_RANGES: &[PlausibleRange] = ranges! {
    "length_m" "m" PIECE_M, "a slice on a rig to the longest blade of a bus", LENGTHS;
    "rubber.density_kg_per_m3" "kg/m3" DENSITY_KG_PER_M3,
        "pure rubber has 860 to 930, highly filled rubber 1600", &[G_PER_CM3];
    "rubber.youngs_modulus_pa" "Pa" [5e5, 5e7],
        "30 to 90 Shore A are about 1 to 20 MPa, and twice that at the frequencies of chatter",
        &[MEGAPASCALS, KILOPASCALS];
    "rubber.loss_factor" "1" [0.01, 1.0],
        "0.05 to 0.5 is usual for rubber, 1 the peak of a damping one", &[PERCENT];
    "head.mass_kg_per_m" "kg/m" [0.01, 20.0], "a strip and its profile, to a carriage", &[G_PER_M];
    "head.stiffness_n_per_m2" "Hz" HEAD_HZ, "arms and rigs spring slowly; 8.88 and 20 Hz are published", &[],
        "the natural frequency of the head", ["head.mass_kg_per_m"],
        |value| Some((value("head.stiffness_n_per_m2")? / value("head.mass_kg_per_m")?).sqrt() / TAU);
    "head.press_force_n_per_m" "N/m" PRESS_N_PER_M,
        "arms press with 10 to 20 N per metre of blade", &[GRAM_FORCE, PER_MILLIMETRE];
    "neck.height_m" "m" LINK_M, LINK_WHY, LENGTHS;
    "neck.top_thickness_m" "m" THICKNESS_M, THICKNESS_WHY, LENGTHS;
    "neck.bottom_thickness_m" "m" THICKNESS_M, THICKNESS_WHY, LENGTHS;
    "neck.hinge_thickness_m" "m" HINGE_THICKNESS_M, HINGE_WHY, LENGTHS;
    "neck.hinge_height_m" "m" HINGE_M, HINGE_WHY, LENGTHS;
    "lip.height_m" "m" LINK_M, LINK_WHY, LENGTHS;
    "lip.top_thickness_m" "m" THICKNESS_M, THICKNESS_WHY, LENGTHS;
    "lip.bottom_thickness_m" "m" THICKNESS_M, THICKNESS_WHY, LENGTHS;
    "lip.hinge_thickness_m" "m" HINGE_THICKNESS_M, HINGE_WHY, LENGTHS;
    "lip.hinge_height_m" "m" HINGE_M, HINGE_WHY, LENGTHS;
};
