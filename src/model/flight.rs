//! The blade off the glass: three degrees of freedom without contact forces, and the effect of an impulse on
//! the tip.
//!
//! With `u` free, Lagrange's equations of the linkage for `(u, theta, phi)` under an upward force `N` and a
//! friction force `f` on the tip are
//!
//! ```text
//! M udd - m_a (sin theta thetadd + cos theta thetad^2) - m_b (sin phi phidd + cos phi phid^2)
//!     = k0 (hd - u) - c0 ud - N
//! m_theta thetadd + m_c cos(theta - phi) phidd - m_a sin theta udd = r1 + N l1 sin theta + f l1 cos theta
//! m_phi phidd + m_c cos(theta - phi) thetadd - m_b sin phi udd = r2 + N l2 sin phi + f l2 cos phi
//! r1 = -m_c sin(theta - phi) phid^2 - m_a vdd cos theta + k2 (phi - theta) + c2 (phid - thetad)
//!      - k1 theta - c1 thetad - shoulder
//! r2 =  m_c sin(theta - phi) thetad^2 - m_b vdd cos phi - k2 (phi - theta) - c2 (phid - thetad)
//! ```
//!
//! The state has the gap between tip and glass, `l1 (1 - cos theta) + l2 (1 - cos phi) - u`, in place of `u`:
//! the gap starts at exactly zero, and its relative accuracy does not depend on the height of the tip.

use super::shoulder::ShoulderContact;
use super::{HeadMotion, LinkDirections, Linkage, Pose};
use serde::Serialize;

/// A state with the tip off the glass.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FlightState {
    /// Angles and rates of both links.
    pub pose: Pose,
    /// Height of the tip above the glass, m.
    pub gap_m: f64,
    /// Rate of change of the height of the tip above the glass, m/s.
    pub gap_rate_m_per_s: f64,
}

/// Accelerations in flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlightAccelerations {
    /// Angular accelerations of neck and lip, rad/s2.
    pub links: [f64; 2],
    /// Acceleration of the gap, m/s2.
    pub gap_m_per_s2: f64,
}

/// Changes of the links' angular rates and of the tip's velocity by a unit impulse on the tip. The changes of
/// the tip's velocity are one column of the inverse contact mass matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpulseResponse {
    /// Changes of the angular rates of neck and lip, rad/s for 1 N s.
    pub rates: [f64; 2],
    /// Change of the tip's velocity away from the glass, m/s for 1 N s.
    pub normal_per_kg: f64,
    /// Change of the tip's velocity along the sweep, m/s for 1 N s.
    pub tangential_per_kg: f64,
}

/// Inverse of the links' mass matrix after the head's drop is eliminated, and the coupling of the links to
/// the drop.
struct ReducedInertia {
    inverse: [[f64; 2]; 2],
    /// Rate of the drop per rate of each link at zero vertical momentum: `m_a sin theta / M` and
    /// `m_b sin phi / M`.
    carried: [f64; 2],
}

impl Linkage {
    fn reduced_inertia(&self, d: &LinkDirections) -> ReducedInertia {
        let carried = [self.m_a * d.sin_theta / self.mass_kg, self.m_b * d.sin_phi / self.mass_kg];
        let a11 = self.m_theta - self.m_a * d.sin_theta * carried[0];
        let a22 = self.m_phi - self.m_b * d.sin_phi * carried[1];
        let a12 = self.m_c * (d.cos_theta * d.cos_phi + d.sin_theta * d.sin_phi)
            - self.m_a * d.sin_theta * carried[1];
        let scale = 1.0 / (a11 * a22 - a12 * a12);
        ReducedInertia { inverse: [[scale * a22, -scale * a12], [-scale * a12, scale * a11]], carried }
    }

    /// Accelerations of the links and of the gap in flight, without contact forces.
    #[inline]
    #[must_use]
    pub fn flight_accelerations(
        &self,
        state: &FlightState,
        d: &LinkDirections,
        head: &HeadMotion,
        lean: ShoulderContact,
    ) -> FlightAccelerations {
        let LinkDirections { sin_theta: st, cos_theta: ct, sin_phi: sp, cos_phi: cp } = *d;
        let Pose { theta, phi, theta_rate: dt, phi_rate: dp } = state.pose;
        let sin_difference = st * cp - ct * sp;
        let (drop, drop_rate) = self.drop_in_flight(state, d);
        let vertical = self.m_a * ct * dt * dt
            + self.m_b * cp * dp * dp
            + self.head.stiffness * (self.preload_displacement_m - drop)
            - self.head.damping * drop_rate;
        let lip = self.lip.stiffness * (phi - theta) + self.lip.damping * (dp - dt);
        let neck =
            self.neck.stiffness * theta + self.neck.damping * dt + self.shoulder_moment(&state.pose, lean);
        let along = head.acceleration_m_per_s2;
        let ReducedInertia { inverse, carried } = self.reduced_inertia(d);
        let right = [
            -self.m_c * sin_difference * dp * dp - self.m_a * along * ct + lip - neck + carried[0] * vertical,
            self.m_c * sin_difference * dt * dt - self.m_b * along * cp - lip + carried[1] * vertical,
        ];
        let links = inverse.map(|row| row[0] * right[0] + row[1] * right[1]);
        let drop_acceleration = vertical / self.mass_kg + carried[0] * links[0] + carried[1] * links[1];
        let gap_m_per_s2 = self.l1_m * (ct * dt * dt + st * links[0])
            + self.l2_m * (cp * dp * dp + sp * links[1])
            - drop_acceleration;
        FlightAccelerations { links, gap_m_per_s2 }
    }

    /// Drop of the head, m, and its rate, m/s, in flight.
    #[inline]
    #[must_use]
    pub fn drop_in_flight(&self, state: &FlightState, d: &LinkDirections) -> (f64, f64) {
        (
            self.head_drop_m(d) - state.gap_m,
            self.head_drop_rate_m_per_s(&state.pose, d) - state.gap_rate_m_per_s,
        )
    }

    /// Responses to a unit impulse on the tip away from the glass, and to one along the sweep, towards +v.
    #[must_use]
    pub fn impulse_responses(&self, d: &LinkDirections) -> [ImpulseResponse; 2] {
        let ReducedInertia { inverse, carried } = self.reduced_inertia(d);
        let normal = [self.l1_m * d.sin_theta, self.l2_m * d.sin_phi];
        let along = [self.l1_m * d.cos_theta, self.l2_m * d.cos_phi];
        let response = |on_links: [f64; 2], on_drop: f64| {
            let right = [on_links[0] + carried[0] * on_drop, on_links[1] + carried[1] * on_drop];
            let rates = inverse.map(|row| row[0] * right[0] + row[1] * right[1]);
            let drop_rate = on_drop / self.mass_kg + carried[0] * rates[0] + carried[1] * rates[1];
            let dot = |a: [f64; 2]| a[0] * rates[0] + a[1] * rates[1];
            ImpulseResponse { rates, normal_per_kg: dot(normal) - drop_rate, tangential_per_kg: dot(along) }
        };
        [response(normal, -1.0), response(along, 0.0)]
    }

    /// Impulse of the drive along the sweep, N s, that keeps the head's velocity constant while the rates of
    /// the links change by `rates`, rad/s, and the tip receives a tangential impulse, N s.
    pub(crate) fn drive_impulse_n_s(&self, d: &LinkDirections, rates: [f64; 2], tangential_n_s: f64) -> f64 {
        self.m_a * d.cos_theta * rates[0] + self.m_b * d.cos_phi * rates[1] - tangential_n_s
    }
}
