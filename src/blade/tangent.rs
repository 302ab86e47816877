//! The first variation of the motion: linear equations for the derivatives of the blade's angles, along a
//! motion whose Taylor series are known.
//!
//! The unknowns are the derivatives `y_i = cos(angle_i) d angle_i` of the sines of both angles: those of the
//! tip's place are `l1 y1 + l2 y2`, whatever the angles are. With `t` for the tangent of an angle,
//! `S_i = t_i y_i` for the derivative of minus its cosine, and in the notation of
//! [`series`](super::series), the equation of each link over its cosine becomes
//!
//! ```text
//! (I_i d angle_i'' + d moment_i + Z_i d angle_i) / cos_i + dX_i + t_i dY_i + (d I_i angle_i'') / cos_i = 0
//! dX_1 = m_c y2'' + m_a d v'' - l1 df + (d m_c p2' + d m_a v'' - d l1 f)       Z_i = cos_i Y_i - sin_i X_i
//! dY_1 = m_c S2'' - m_a du'' - l1 dN + (d m_c q2' - d m_a u'' - d l1 N)        likewise for the lip
//! slip:   df = -sigma mu dN + b N E d v3' - sigma N (d a e + d c) + d b v3' N E,   E = a e
//! stick:  l1 y1 + l2 y2 + d v + d l1 sin theta + d l2 sin phi stays, and df is what holds it
//! flight: dN = df = 0, and the gap between tip and glass is a third unknown
//! ```
//!
//! Everything that multiplies an unknown is the same for all directions, and so is what a change of one
//! constant adds.

mod channel;
mod course;
mod equations;
mod instants;
mod linkage;
mod row;
mod source;

pub use channel::{LinearForm, ModelChannel};
pub use course::ReferenceMotion;
pub use equations::{StickEquation, TangentMatrices};
pub use instants::{LinkAttitudes, MotionSamples, fill_lanes};
pub use linkage::{LinkageConstant, LinkageTangent, SpringTangent};
pub use row::{LANES, LaneVector};
pub use source::{ForcingTerms, HeadMotionChange};

/// Derivatives of the state at the start of a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct StateTangent {
    /// Of the angles of neck and lip, rad over the unit of the direction, and so on.
    pub angle: [LaneVector; 2],
    /// Of the angular rates, rad/s.
    pub rate: [LaneVector; 2],
    /// Of the gap between tip and glass, m: nothing in contact.
    pub gap_m: LaneVector,
    /// Of its rate, m/s.
    pub gap_rate: LaneVector,
}
