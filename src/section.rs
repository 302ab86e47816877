//! From the cross section of a rubber blade to the `[blade]` table of a scene, and from a scene back to what
//! ruler and scale show.
//!
//! Neck and lip are trapezoids of rubber of density `rho` over a length `b` of blade: height `h`, thickness
//! `t1` at the top and `t2` at the bottom.
//!
//! ```text
//! mass       m = rho b h (t1 + t2)/2
//! centre     g = h (t1 + 2 t2)/(3 (t1 + t2)), from the top
//! inertia    J = rho b (h^3 (t1^2 + 4 t1 t2 + t2^2)/(36 (t1 + t2)) + h (t1 + t2) (t1^2 + t2^2)/48)
//! ```
//!
//! For a rectangle that is `g = h/2` and `J = m (h^2 + t^2)/12`. A blade is long compared with its thickness
//! and bends as a plate, with `E' = E/(1 - nu^2)` in place of Young's modulus; rubber keeps its volume, `nu =
//! 1/2`. A link turns on a hinge of thickness `t` and height `L`, or where it has none bends over its own
//! height, `s` from the bottom, so that a force at its bottom moves that as far as the spring does:
//!
//! ```text
//! with a hinge     k = E' b t^3/(12 L)
//! without          1/k = 12/(E' b h^2) int_0^h s^2/t(s)^3 ds     (rectangle: k = 3 E' b t^3/(12 h))
//! ```
//!
//! A loss factor `eta` gives a resonance the damping ratio `eta/2`. Everything but lengths of the section,
//! ratios and frequencies is proportional to `b`.

pub mod checks;
mod estimate;
mod input;
mod keys;
mod shape;

pub use estimate::{BladeEstimate, BladeTableEntry};
pub use input::{BladeSection, SectionError};
pub use shape::{LinkSection, RubberHinge, plate_modulus_pa};
