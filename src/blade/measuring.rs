//! How each number of a scene is measured on a blade.

use super::parameters::ParameterQuantity;

/// What the masses, inertias, stiffnesses, dampings and the preload of a scene are for.
///
/// The equations of motion keep their solution if all of these are multiplied by one factor, so that any
/// length of blade will do.
pub const SAME_LENGTH_ADVICE: &str = "Masses, inertias, stiffnesses, dampings and the preload are all for one and \
                               the same length of blade: the whole blade, the piece on the rig, or one metre.";

impl ParameterQuantity {
    /// How the quantity is measured, in one sentence.
    #[must_use]
    pub fn measurement_method(self) -> &'static str {
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
            Self::DriveAmplitude => "half the way of the head from one end of the stroke to the other",
            Self::DriveFrequency => "one over the time of a stroke there and back",
            Self::Restitution => "0 for a lip that does not bounce",
        }
    }
}
