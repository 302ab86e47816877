//! Friction between lip tip and glass, equations (4) and (5), and the laws that a scene may choose instead.
//!
//! At the speed `s` of the tip in the direction of slip, the coefficient is
//!
//! ```text
//! mu(s) = r (a F(w) + c + viscous s),   r = 1 forward, backward_ratio backward
//! exponential: F = exp(-w),      w = b s        rational: F = 1 / (1 + w),   w = b s
//! Stribeck:    F = exp(-w),      w = (b s)^n    table:    F = w, a cubic of s between two points
//! ```
//!
//! A table has `a = b = 1` and `c = 0`. A tip at rest holds up to `static_ratio` times `mu(0)`. The knots of
//! a law are the speeds at which its formula changes, and the pieces lie between them. The points of a table
//! are knots. A Stribeck law has one at a small speed, unless `n` is 1 or 2: below it a parabola replaces the
//! power, which has no Taylor series at rest if `n` is not whole. The coefficient is continuous at a knot,
//! but a Taylor series is valid only up to it.

use portable_math as math;
use serde::Serialize;

/// Law between friction coefficient and speed.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
#[allow(clippy::large_enum_variant)] // a linkage is copied, and a box would allocate in each copy
pub enum FrictionShape {
    /// Equation (4).
    #[default]
    Exponential,
    /// Stribeck's curve, with a free exponent of the speed.
    Stribeck,
    /// The coefficient falls as `1 / (1 + b s)`.
    Rational,
    /// Monotone cubics through points.
    Table(FrictionTable),
}

/// Name of each law in a scene, with the names of the parameters that not every law has.
pub(crate) const LAW_KEYS: [(&str, &[&str]); 4] = [
    ("exponential", &["friction.a", "friction.b_s_per_m", "friction.c"]),
    (
        "stribeck",
        &[
            "friction.limit_at_zero",
            "friction.coulomb_level",
            "friction.stribeck_speed_m_per_s",
            "friction.stribeck_exponent",
        ],
    ),
    ("rational", &["friction.limit_at_zero", "friction.rational_s_per_m"]),
    ("table", &[]),
];

impl FrictionShape {
    /// Name of the law in a scene.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Exponential => "exponential",
            Self::Stribeck => "stribeck",
            Self::Rational => "rational",
            Self::Table(_) => "table",
        }
    }

    /// The law with this name; `None` for a table, which needs its points, and for an unknown name.
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        [Self::Exponential, Self::Stribeck, Self::Rational].into_iter().find(|law| law.name() == name)
    }

    /// Names of the parameters that not every law has.
    pub(crate) fn own_parameters(&self) -> &'static [&'static str] {
        LAW_KEYS.iter().find(|(law, _)| *law == self.name()).map_or(&[], |(_, keys)| keys)
    }

    /// Whether a parameter belongs to this law or to every law.
    pub(crate) fn has_parameter(&self, name: &str) -> bool {
        let mut laws = LAW_KEYS.iter().filter(|(_, keys)| keys.contains(&name)).peekable();
        laws.peek().is_none() || laws.any(|(law, _)| *law == self.name())
    }
}

/// Coefficients of the friction law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrictionLaw {
    /// `A`: the part of the friction coefficient that changes with speed, at zero speed.
    pub a: f64,
    /// `B`, s/m: reciprocal of the speed over which the part `A` changes. With equation (4) this part is
    /// `A/e` at the speed `1/B`.
    pub b_s_per_m: f64,
    /// `C`: the part of the friction coefficient that does not depend on speed.
    pub c: f64,
    /// How the part `A` changes with speed.
    #[serde(skip_serializing_if = "is_exponential")]
    pub shape: FrictionShape,
    /// Exponent `n` of the speed in Stribeck's curve.
    #[serde(skip_serializing_if = "is_one")]
    pub exponent: f64,
    /// Rise of the coefficient with speed, s/m, added to the law.
    #[serde(skip_serializing_if = "is_zero")]
    pub viscous_s_per_m: f64,
    /// Ratio of the largest coefficient at rest to that of slip at zero speed; at least 1.
    #[serde(skip_serializing_if = "is_one")]
    pub static_ratio: f64,
    /// Ratio of the coefficients towards -v, of slip and at rest, to those towards +v.
    #[serde(skip_serializing_if = "is_one")]
    pub backward_ratio: f64,
}

fn is_exponential(shape: &FrictionShape) -> bool {
    *shape == FrictionShape::Exponential
}

#[allow(clippy::trivially_copy_pass_by_ref)] // (serde hands references)
fn is_one(x: &f64) -> bool {
    *x == 1.0
}

#[allow(clippy::trivially_copy_pass_by_ref)] // (serde hands references)
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

impl FrictionLaw {
    /// Value of `b s` below which a parabola through zero replaces the power of a Stribeck law. Value and
    /// slope are those of the power here, and below the parabola differs from it by less than `0.4 LOW^n`.
    const LOW: f64 = 1e-3;

    /// The law of equation (4) without further terms.
    #[must_use]
    pub const fn exponential(a: f64, b_s_per_m: f64, c: f64) -> Self {
        let shape = FrictionShape::Exponential;
        let (exponent, viscous_s_per_m, static_ratio, backward_ratio) = (1.0, 0.0, 1.0, 1.0);
        Self { a, b_s_per_m, c, shape, exponent, viscous_s_per_m, static_ratio, backward_ratio }
    }

    /// Coefficient of dynamic friction, without the sign of equation (4), at a speed, m/s, in a direction of
    /// slip, +1 or -1. The first piece goes on at slightly negative speeds, which trial steps may reach.
    #[inline]
    #[must_use]
    pub fn dynamic_coefficient(&self, speed_m_per_s: f64, direction: f64) -> f64 {
        let varying = match self.shape {
            FrictionShape::Exponential => math::exp(-self.b_s_per_m * speed_m_per_s),
            _ => self.varying_part(speed_m_per_s)[0],
        };
        self.direction_factor(direction) * (self.a * varying + self.c + self.viscous_s_per_m * speed_m_per_s)
    }

    /// Limit of the dynamic coefficient at zero speed, in a direction of slip, +1 or -1.
    #[inline]
    #[must_use]
    pub fn limit_at_zero(&self, direction: f64) -> f64 {
        self.direction_factor(direction) * (self.a * self.varying_part_at_zero() + self.c)
    }

    /// Largest coefficient at rest before the tip slips in a direction, +1 or -1 (equation (5)).
    #[inline]
    #[must_use]
    pub fn static_coefficient(&self, direction: f64) -> f64 {
        self.static_ratio * self.limit_at_zero(direction)
    }

    /// Factor on all coefficients in a direction.
    #[inline]
    pub(crate) fn direction_factor(&self, direction: f64) -> f64 {
        if direction < 0.0 { self.backward_ratio } else { 1.0 }
    }

    /// Value of `F` at zero speed.
    #[inline]
    pub(crate) fn varying_part_at_zero(&self) -> f64 {
        match &self.shape {
            FrictionShape::Table(table) => table.first(),
            _ => 1.0,
        }
    }

    /// `F` with its derivatives by `b s` and by the exponent, at a speed, m/s.
    pub(crate) fn varying_part(&self, speed_m_per_s: f64) -> [f64; 3] {
        let [w, slope, by_exponent] = self.argument(speed_m_per_s);
        let value = self.varying_part_from(w);
        let outer = match self.shape {
            FrictionShape::Exponential | FrictionShape::Stribeck => -value,
            FrictionShape::Rational => -value * value,
            FrictionShape::Table(_) => 1.0,
        };
        [value, outer * slope, outer * by_exponent]
    }

    /// `F` for its argument.
    fn varying_part_from(&self, w: f64) -> f64 {
        match self.shape {
            FrictionShape::Exponential | FrictionShape::Stribeck => math::exp(-w),
            FrictionShape::Rational => 1.0 / (1.0 + w),
            FrictionShape::Table(_) => w,
        }
    }

    /// Argument `w` of `F` with its derivatives by `b s` and by the exponent.
    fn argument(&self, speed_m_per_s: f64) -> [f64; 3] {
        let (x, n) = (self.b_s_per_m * speed_m_per_s, self.exponent);
        let power = || math::powf(x, n);
        let [w, slope] = match self.polynomial(self.piece_at(speed_m_per_s)) {
            Some((start, c)) => {
                let u = x - start;
                [((c[3] * u + c[2]) * u + c[1]) * u + c[0], (3.0 * c[3] * u + 2.0 * c[2]) * u + c[1]]
            }
            None => [power(), n * power() / x],
        };
        let by_exponent = match self.shape {
            FrictionShape::Stribeck if x >= Self::LOW => power() * math::ln(x),
            FrictionShape::Stribeck => {
                let (scale, log) = (math::powf(Self::LOW, n - 1.0), math::ln(Self::LOW));
                let square = scale * (1.0 + (n - 1.0) * log) / Self::LOW;
                x * (scale * ((2.0 - n) * log - 1.0) + x * square)
            }
            _ => 0.0,
        };
        [w, slope, by_exponent]
    }

    /// Value of `b s` at the start of a piece, and coefficients of `w` as a cubic of `b s` minus that value;
    /// `None` where `w` is a power.
    fn polynomial(&self, piece: usize) -> Option<(f64, [f64; 4])> {
        match &self.shape {
            FrictionShape::Exponential | FrictionShape::Rational => Some((0.0, [0.0, 1.0, 0.0, 0.0])),
            FrictionShape::Stribeck if piece == 0 => {
                let (n, scale) = (self.exponent, math::powf(Self::LOW, self.exponent - 1.0));
                Some((0.0, [0.0, (2.0 - n) * scale, (n - 1.0) * scale / Self::LOW, 0.0]))
            }
            FrictionShape::Stribeck => None,
            FrictionShape::Table(table) => Some(table.polynomial(piece)),
        }
    }

    /// Speed at which piece `i` of the law ends, m/s; infinite for the last one.
    fn knot_m_per_s(&self, i: usize) -> f64 {
        match &self.shape {
            FrictionShape::Stribeck if i == 0 && self.exponent != 1.0 && self.exponent != 2.0 => {
                Self::LOW / self.b_s_per_m
            }
            FrictionShape::Table(table) => {
                table.speed_m_per_s(i).map_or(f64::INFINITY, |speed| speed / self.b_s_per_m)
            }
            _ => f64::INFINITY,
        }
    }

    /// Index of the piece of the law that begins at or contains a speed, m/s.
    #[must_use]
    pub fn piece_at(&self, speed_m_per_s: f64) -> usize {
        let mut piece = 0;
        // (the speed of a diverging trial step can be infinite, as the end of the last piece is)
        while self.knot_m_per_s(piece) <= speed_m_per_s.min(f64::MAX) {
            piece += 1;
        }
        piece
    }

    /// Speeds at which a piece begins and ends, m/s.
    #[inline]
    #[must_use]
    pub fn piece_ends_m_per_s(&self, piece: usize) -> [f64; 2] {
        [piece.checked_sub(1).map_or(0.0, |before| self.knot_m_per_s(before)), self.knot_m_per_s(piece)]
    }

    /// Whether the coefficient of slip is that of equation (4), without further terms.
    #[inline]
    pub(crate) fn is_plain(&self) -> bool {
        is_exponential(&self.shape) && self.viscous_s_per_m == 0.0
    }

    /// Value of a parameter of any law, in its SI unit, with which that law comes near this one; `None` for
    /// a name that no law has.
    pub(crate) fn nearest_value(&self, name: &str) -> Option<f64> {
        let limit = self.a * self.varying_part_at_zero() + self.c;
        Some(match name {
            "friction.a" => self.a,
            "friction.b_s_per_m" => self.b_s_per_m,
            "friction.c" | "friction.coulomb_level" => self.c,
            "friction.limit_at_zero" => limit,
            "friction.stribeck_speed_m_per_s" => 1.0 / self.b_s_per_m,
            "friction.stribeck_exponent" => self.exponent,
            // the slope at zero speed is equal
            "friction.rational_s_per_m" => self.a * self.b_s_per_m / limit,
            "friction.static_ratio" => self.static_ratio,
            "friction.viscous_s_per_m" => self.viscous_s_per_m,
            "friction.backward_ratio" => self.backward_ratio,
            _ => return None,
        })
    }

    /// The law for speeds in units of `unit`, m/s.
    pub(crate) fn with_speed_unit(self, unit: f64) -> Self {
        let mut law = self;
        law.b_s_per_m *= unit;
        law.viscous_s_per_m *= unit;
        law
    }
}

// Points of a table.

/// Coefficients of friction at speeds, with slopes for monotone cubics between them (Fritsch and Butland
/// 1984, SIAM J. Sci. Stat. Comp. 5, with the end slopes of SciPy's `PchipInterpolator`). Outside the points
/// the coefficient is constant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrictionTable {
    /// Speed, m/s, coefficient, and slope, s/m.
    points: [[f64; 3]; Self::MOST_POINTS],
    count: usize,
}

impl FrictionTable {
    /// Maximum number of points.
    pub const MOST_POINTS: usize = 32;

    /// The table through points (speed in m/s, coefficient); `None` unless there are 2 to
    /// [`Self::MOST_POINTS`] of them with increasing speeds.
    #[must_use]
    pub fn from_points(given: &[(f64, f64)]) -> Option<Self> {
        let count = given.len();
        let is_increasing = given.windows(2).all(|pair| pair[0].0 < pair[1].0);
        if !(2..=Self::MOST_POINTS).contains(&count) || !is_increasing {
            return None;
        }
        let mut points = [[0.0; 3]; Self::MOST_POINTS];
        let width = |i: usize| given[i + 1].0 - given[i].0;
        let secant = |i: usize| (given[i + 1].1 - given[i].1) / width(i);
        let end = |near: usize, next: usize| {
            if count == 2 {
                return secant(0);
            }
            let (h, d) = ([width(near), width(next)], [secant(near), secant(next)]);
            let slope = ((2.0 * h[0] + h[1]) * d[0] - h[0] * d[1]) / (h[0] + h[1]);
            match () {
                () if slope * d[0] <= 0.0 => 0.0,
                () if d[0] * d[1] <= 0.0 && slope.abs() > 3.0 * d[0].abs() => 3.0 * d[0],
                () => slope,
            }
        };
        for (i, (speed, coefficient)) in given.iter().enumerate() {
            let slope = match i {
                0 => end(0, 1),
                _ if i + 1 == count => end(count - 2, count.saturating_sub(3)),
                _ if secant(i - 1) * secant(i) <= 0.0 => 0.0,
                _ => {
                    let weights = [2.0 * width(i) + width(i - 1), width(i) + 2.0 * width(i - 1)];
                    (weights[0] + weights[1]) / (weights[0] / secant(i - 1) + weights[1] / secant(i))
                }
            };
            points[i] = [*speed, *coefficient, slope];
        }
        Some(Self { points, count })
    }

    /// Speeds, m/s, and coefficients of the points.
    #[must_use]
    pub fn points(&self) -> impl ExactSizeIterator<Item = (f64, f64)> + '_ {
        self.points[..self.count].iter().map(|[speed, coefficient, _]| (*speed, *coefficient))
    }

    /// Coefficient at rest.
    fn first(&self) -> f64 {
        self.points[0][1]
    }

    /// Speed of point `i`, m/s.
    fn speed_m_per_s(&self, i: usize) -> Option<f64> {
        self.points[..self.count].get(i).map(|point| point[0])
    }

    /// Start of a piece, m/s, and coefficients of its polynomial in the speed beyond the start. Piece `i`
    /// ends at point `i`.
    fn polynomial(&self, piece: usize) -> (f64, [f64; 4]) {
        let points = &self.points[..self.count];
        match (piece.checked_sub(1).map(|i| points[i]), points.get(piece)) {
            (Some([from, y, slope]), Some([to, y_end, slope_end])) => {
                let (h, d) = (to - from, (y_end - y) / (to - from));
                let third = (slope + slope_end - 2.0 * d) / (h * h);
                (from, [y, slope, (3.0 * d - 2.0 * slope - slope_end) / h, third])
            }
            (Some([from, y, _]), None) => (from, [y, 0.0, 0.0, 0.0]),
            (None, _) => (0.0, [points[0][1], 0.0, 0.0, 0.0]),
        }
    }
}

// Taylor coefficients along a motion.

/// Taylor coefficients of the part `F` of a friction law along a motion, by recurrence from those of the
/// speed; `K` is the number of coefficients.
#[derive(Debug, Clone)]
pub struct FrictionSeries<const K: usize> {
    /// Coefficients of the argument of `F` as a cubic within the piece of the law; `None` where it is a
    /// power.
    polynomial: Option<[f64; 4]>,
    /// Coefficients of `b s` beyond the start of the piece, of its square, of the argument of `F`, and of
    /// `F`.
    rows: [[f64; 4]; K],
}

impl<const K: usize> Default for FrictionSeries<K> {
    fn default() -> Self {
        Self { polynomial: None, rows: [[0.0; 4]; K] }
    }
}

/// Sum of `f(j)` from `first` to `last`.
fn sum(first: usize, last: usize, f: impl Fn(usize) -> f64) -> f64 {
    (first..=last).map(f).sum()
}

impl<const K: usize> FrictionSeries<K> {
    /// Starts the series in a piece of the law, from the speed in the direction of slip, m/s. Returns the
    /// friction coefficient in the forward direction.
    pub fn start_series(&mut self, law: &FrictionLaw, piece: usize, speed_m_per_s: f64) -> f64 {
        let x = law.b_s_per_m * speed_m_per_s;
        let polynomial = law.polynomial(piece);
        let u = x - polynomial.map_or(0.0, |(start, _)| start);
        self.polynomial = polynomial.map(|(_, c)| c);
        let w = match self.polynomial {
            Some(c) => ((c[3] * u + c[2]) * u + c[1]) * u + c[0],
            None => math::powf(u, law.exponent),
        };
        let varying = law.varying_part_from(w);
        self.rows[0] = [u, u * u, w, varying];
        law.a * varying + law.c + law.viscous_s_per_m * speed_m_per_s
    }

    /// Computes coefficient `k >= 1` of the series from coefficient `k` of the speed and from all lower ones.
    /// Returns coefficient `k` of the friction coefficient in the forward direction.
    pub fn advance_series(&mut self, law: &FrictionLaw, k: usize, speed: f64) -> f64 {
        let (order, n) = (k as f64, law.exponent);
        self.rows[k] = [law.b_s_per_m * speed, 0.0, 0.0, 0.0];
        let rows = &self.rows;
        let square = sum(0, k, |j| rows[j][0] * rows[k - j][0]);
        let w = match self.polynomial {
            Some([_, c1, 0.0, 0.0]) => c1 * rows[k][0],
            Some([_, c1, c2, c3]) => {
                let cube = rows[0][0] * square + sum(1, k, |j| rows[j][0] * rows[k - j][1]);
                c1 * rows[k][0] + c2 * square + c3 * cube
            }
            // w = u^n satisfies u w' = n u' w
            None => {
                let weight = |j: usize| n * j as f64 - (k - j) as f64;
                sum(1, k, |j| weight(j) * rows[j][0] * rows[k - j][2]) / (order * rows[0][0])
            }
        };
        let argument = |j: usize| if j == k { w } else { rows[j][2] };
        let varying = match law.shape {
            // F' = -w' F
            FrictionShape::Exponential | FrictionShape::Stribeck => {
                -sum(1, k, |j| j as f64 * argument(j) * rows[k - j][3]) / order
            }
            // F (1 + w) = 1
            FrictionShape::Rational => -rows[0][3] * sum(1, k, |j| argument(j) * rows[k - j][3]),
            FrictionShape::Table(_) => w,
        };
        self.rows[k] = [rows[k][0], square, w, varying];
        law.a * varying + law.viscous_s_per_m * speed
    }

    /// Coefficient `k` of the argument of `F`.
    pub(crate) fn argument(&self, k: usize) -> f64 {
        self.rows[k][2]
    }
}
