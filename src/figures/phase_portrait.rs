//! Phase portraits: deflection against the velocity of the tip, measured against model.

pub(crate) mod caption;

use crate::chart::{ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Series};
use crate::figures::subtitle;
use crate::math;

/// A point of the motion: deflection, m, and velocity of the tip, m/s; `None` interrupts it.
pub type PhasePoint = Option<(f64, f64)>;

/// A part of the motion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PortraitPart {
    /// What tells it from the others.
    pub name: String,
    /// Measured states in order of time; empty for none.
    pub measured: Vec<PhasePoint>,
    /// States of the model in order of time, close enough for a line.
    pub model: Vec<PhasePoint>,
}

/// What a portrait shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PhasePortrait {
    /// Heading.
    pub title: String,
    /// More to say; empty for none.
    pub note: String,
    /// Whether the measured motion is one that no camera took.
    pub synthetic: bool,
    /// The parts, side by side.
    pub parts: Vec<PortraitPart>,
}

/// Height of a panel, mm: as high as it is wide where two stand side by side.
const HEIGHT_MM: f64 = 62.0;
const MILLIMETRES: f64 = 1e3;

/// The figure.
#[must_use]
pub fn draw_figure(shown: &PhasePortrait) -> Figure {
    Figure {
        title: shown.title.clone(),
        subtitle: subtitle(shown.synthetic, &shown.note),
        watermarked: shown.synthetic,
        description: "Phase portrait: velocity of the tip over deflection.".to_owned(),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels: shown.parts.iter().map(|part| draw_panel(part, frame_mark(&shown.parts))).collect(),
    }
}

/// Measured states up to which each is a circle: more are dots, which stand apart in a column of a journal.
const MOST_CIRCLES: usize = 80;

/// How measured states are drawn, the same in all parts: a line from frame to frame would show the noise of
/// the differences, and corners that no tip makes.
fn frame_mark(parts: &[PortraitPart]) -> Mark {
    let most = parts.iter().map(|part| part.measured.iter().flatten().count()).max();
    if most.is_none_or(|most| most <= MOST_CIRCLES) { Mark::Circles } else { Mark::Dots }
}

fn draw_panel(part: &PortraitPart, frames: Mark) -> Panel {
    let styles = [
        ("model", Colour::Vermilion, Mark::Line, &part.model),
        ("measured", Colour::Black, frames, &part.measured),
    ];
    let scaled = |points: &[PhasePoint]| {
        points.iter().map(|p| p.map(|(x, v)| (x * MILLIMETRES, v * MILLIMETRES))).collect()
    };
    let drawn = styles.into_iter().filter(|(.., points)| !points.is_empty());
    let series = drawn.map(|(label, colour, mark, points)| Series {
        label: label.to_owned(),
        colour,
        mark,
        points: scaled(points),
        ..Series::default()
    });
    let (low, high) = deflection_limits_mm(part);
    Panel {
        title: part.name.clone(),
        x: ChartAxis::linear("deflection, mm").with_range(low, high),
        y: ChartAxis::linear("tip velocity, mm/s"),
        height_mm: HEIGHT_MM,
        series: series.collect(),
        ..Panel::default()
    }
}

/// Ends of the axis of the deflection, mm: every part has its own, also where the parts stand one below the
/// other.
fn deflection_limits_mm(part: &PortraitPart) -> (f64, f64) {
    const AXIS_MARGIN: f64 = 0.05;
    const LEAST_SPAN: f64 = 1e-4; // of the values: less is rounding, and labels would have no digits for it
    let all = part
        .measured
        .iter()
        .chain(&part.model)
        .flatten()
        .map(|(x, _)| x * MILLIMETRES)
        .filter(|x| x.is_finite());
    let (low, high) =
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    let room = (AXIS_MARGIN * (high - low)).max(LEAST_SPAN * low.abs().max(high.abs()));
    (low - room, high + room)
}

/// Most noise of the velocity over its swing in a part, as standard deviation over peak to peak: cycles side
/// by side still stand apart.
pub(crate) const MAX_VELOCITY_NOISE: f64 = 0.1;
/// Longest difference that is chosen, periods of the fastest component. A fifth takes 6 % of its velocity, of
/// recording and model alike, and at a component of 900 Hz and noise of 2 um it leaves 13 mm/s; a twentieth
/// would take 0.4 % and leave 51 mm/s, a quarter of a usual swing, at any rate.
const MAX_DIFFERENCE_PERIODS: f64 = 0.2;

/// How velocities are taken: as the difference of the places in two frames, as many frames before as after.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CentralDifference {
    /// Frames to either side.
    pub half_frames: usize,
    /// Frames per second, 1/s.
    pub frame_rate_hz: f64,
}

impl CentralDifference {
    /// Of the neighbouring frames.
    #[must_use]
    pub fn of_neighbouring_frames(frame_rate_hz: f64) -> Self {
        Self { half_frames: 1, frame_rate_hz }
    }

    /// The shortest in which white noise of the place of a standard deviation, m, leaves `MAX_VELOCITY_NOISE` of
    /// the swing of the velocity, m/s; no longer than a fifth of the period of the fastest component, Hz, and
    /// the shortest there is where none is known.
    #[must_use]
    pub fn for_noise(frame_rate_hz: f64, noise_m: f64, swing_m_per_s: f64, fastest_hz: Option<f64>) -> Self {
        let shortest = Self::of_neighbouring_frames(frame_rate_hz);
        let quiet = if noise_m > 0.0 {
            (shortest.noise_m_per_s(noise_m) / (MAX_VELOCITY_NOISE * swing_m_per_s)).ceil()
        } else {
            1.0
        };
        let longest =
            fastest_hz.map_or(1.0, |hz| (MAX_DIFFERENCE_PERIODS * frame_rate_hz / hz / 2.0).floor());
        Self { half_frames: quiet.min(longest).max(1.0) as usize, ..shortest }
    }

    /// Time between the two frames, s.
    #[must_use]
    pub fn frame_gap_s(&self) -> f64 {
        2.0 * self.half_frames as f64 / self.frame_rate_hz
    }

    /// Standard deviation of the velocity, m/s, that white noise of the place leaves, m: `sqrt(2)` times it
    /// over the time between the frames.
    #[must_use]
    pub(crate) fn noise_m_per_s(&self, noise_m: f64) -> f64 {
        noise_m * std::f64::consts::SQRT_2 / self.frame_gap_s()
    }

    /// Share that is left of a velocity that swings at a frequency, Hz: `sin(x)/x` of pi times the frequency
    /// and the time between the frames.
    #[must_use]
    pub fn velocity_gain(&self, frequency_hz: f64) -> f64 {
        let x = std::f64::consts::PI * frequency_hz * self.frame_gap_s();
        if x > 0.0 { math::sin(x) / x } else { 1.0 }
    }

    /// Time from the frame to either of the two, s.
    #[must_use]
    pub(crate) fn half_width_s(&self) -> f64 {
        self.half_frames as f64 / self.frame_rate_hz
    }

    /// Deflection and velocity of the tip in every frame that has one so far before and after it; `None`
    /// where one of the three is missing.
    #[must_use]
    pub fn phase_points(&self, deflection_m: &[Option<f64>], tip_x_m: &[Option<f64>]) -> Vec<PhasePoint> {
        let (half, apart_s) = (self.half_frames, self.frame_gap_s());
        let middle = |(deflection, tip): (&Option<f64>, &[Option<f64>])| {
            let (before, after) = (tip.first().copied().flatten()?, tip.last().copied().flatten()?);
            tip[half].and(deflection.map(|x| (x, (after - before) / apart_s)))
        };
        deflection_m.iter().skip(half).zip(tip_x_m.windows(2 * half + 1)).map(middle).collect()
    }
}

/// From the least to the greatest velocity, m/s; `None` without a state.
#[must_use]
pub(crate) fn swing_m_per_s(states: &[PhasePoint]) -> Option<f64> {
    let velocities = || states.iter().flatten().map(|(_, v)| *v).filter(|v| v.is_finite());
    velocities().reduce(f64::max).zip(velocities().reduce(f64::min)).map(|(high, low)| high - low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Medium;

    #[test]
    fn the_velocity_is_the_central_difference_and_gaps_stay_gaps() {
        let tip: Vec<Option<f64>> = (0..8).map(|i| (i != 4).then(|| f64::from(i * i))).collect();
        let deflection: Vec<Option<f64>> = (0..8).map(|i| (i != 2).then(|| f64::from(i))).collect();
        let expected = [Some((1.0, 20.0)), None, None, Some((4.0, 80.0)), None, Some((6.0, 120.0))];
        let states = |half_frames, deflection: &[_], tip: &[_]| {
            CentralDifference { half_frames, frame_rate_hz: 10.0 }.phase_points(deflection, tip)
        };
        assert_eq!(states(1, &deflection, &tip)[..3], expected[..3]);
        assert_eq!(states(1, &deflection, &tip)[4..], expected[4..]);
        // the frame itself is missing: no state, although its neighbours would give a velocity
        assert_eq!(states(1, &deflection, &tip)[3], None);
        assert_eq!(states(2, &deflection, &tip), [None, Some((3.0, 60.0)), None, Some((5.0, 100.0))]);
        assert_eq!(states(1, &[Some(0.0); 2], &[Some(0.0); 2]), []);
    }

    const FASTEST_HZ: f64 = 900.0;

    /// A tip that swings over a number of frames by an amplitude, with white noise, m, and its exact
    /// velocity.
    fn swinging(rate_hz: f64, amplitude_m: f64, noise_m: f64, frames: u32) -> (Vec<Option<f64>>, Vec<f64>) {
        let mut state = 7_u64;
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt()
        };
        let angular = std::f64::consts::TAU * FASTEST_HZ;
        let phase = |i| angular * f64::from(i) / rate_hz;
        let tip = (0..frames).map(|i| Some(amplitude_m * phase(i).sin() + noise_m * draw())).collect();
        (tip, (0..frames).map(|i| amplitude_m * angular * phase(i).cos()).collect())
    }

    /// Standard deviation of the velocities from a share of the exact ones, m/s.
    fn off(difference: CentralDifference, tip: &[Option<f64>], exact: &[f64], share: f64) -> f64 {
        let found = difference.phase_points(tip, tip);
        let squares: Vec<f64> = found
            .iter()
            .flatten()
            .zip(&exact[difference.half_frames..])
            .map(|((_, v), e)| (v - share * e).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    #[test]
    fn a_sine_loses_what_the_difference_takes_and_the_longest_takes_little() {
        let (tip, exact) = swinging(2e5, 1e-4, 0.0, 2000);
        for half_frames in [1, 2, 5, 40] {
            let difference = CentralDifference { half_frames, frame_rate_hz: 2e5 };
            let error = off(difference, &tip, &exact, difference.velocity_gain(FASTEST_HZ));
            assert!(error < 1e-9, "{half_frames}: {error}");
        }
        let longest = CentralDifference::for_noise(2e5, 1.0, 1e-9, Some(FASTEST_HZ));
        assert!(
            longest.frame_gap_s() <= MAX_DIFFERENCE_PERIODS / FASTEST_HZ && longest.half_frames == 22,
            "{longest:?}"
        );
        assert!(longest.velocity_gain(FASTEST_HZ) > 0.935, "{}", longest.velocity_gain(FASTEST_HZ));
    }

    #[test]
    fn noise_is_kept_below_a_tenth_of_the_swing_by_the_shortest_difference_that_does() {
        const NOISE_M: f64 = 2e-6;
        for (rate_hz, half_frames) in [(5e3, 1), (4e4, 1), (1e5, 2), (2e5, 3)] {
            let (tip, exact) = swinging(rate_hz, 1e-4, NOISE_M, 40_000);
            let swing = 2.0 * exact[0];
            let chosen = CentralDifference::for_noise(rate_hz, NOISE_M, swing, Some(FASTEST_HZ));
            assert_eq!(chosen.half_frames, half_frames, "at {rate_hz} Hz");
            let noise = off(chosen, &tip, &exact, chosen.velocity_gain(FASTEST_HZ));
            assert!(
                (noise / chosen.noise_m_per_s(NOISE_M) - 1.0).abs() < 0.03
                    && noise < MAX_VELOCITY_NOISE * swing,
                "{noise} of {swing}"
            );
        }
        // of a component of a tenth of that amplitude no difference that follows it is quiet enough, and it
        // stays as short as it has to
        let drowned = CentralDifference::for_noise(2e5, NOISE_M, 0.1, Some(FASTEST_HZ));
        assert_eq!(drowned.half_frames, 22);
        assert!(drowned.noise_m_per_s(NOISE_M) > MAX_VELOCITY_NOISE * 0.1);
        assert_eq!(CentralDifference::for_noise(2e5, NOISE_M, 0.1, None).half_frames, 1);
        assert_eq!(CentralDifference::for_noise(2e5, 0.0, 0.0, Some(FASTEST_HZ)).half_frames, 1);
    }

    #[test]
    fn the_swing_is_from_the_least_to_the_greatest_velocity() {
        assert_eq!(swing_m_per_s(&[Some((0.0, -0.2)), None, Some((1.0, 0.3)), Some((1.0, 0.1))]), Some(0.5));
        assert_eq!(swing_m_per_s(&[None]), None);
    }

    #[test]
    fn measured_states_are_points_and_never_a_line() {
        let measured = |count: usize| {
            let part = PortraitPart { measured: vec![Some((1e-3, 0.1)); count], ..PortraitPart::default() };
            draw_figure(&PhasePortrait { parts: vec![part], ..PhasePortrait::default() }).panels[0].series[0]
                .mark
        };
        assert_eq!([measured(10), measured(200)], [Mark::Circles, Mark::Dots]);
    }

    #[test]
    fn parts_stand_side_by_side_and_what_was_not_measured_has_no_entry() {
        let part = PortraitPart {
            name: "late".to_owned(),
            model: vec![Some((1e-3, 0.1)), Some((2e-3, 0.2))],
            ..PortraitPart::default()
        };
        let drawn = draw_figure(&PhasePortrait {
            parts: vec![part.clone(), part],
            synthetic: true,
            ..PhasePortrait::default()
        });
        assert_eq!((drawn.panels.len(), drawn.columns), (2, 2));
        assert_eq!(drawn.panels[0].series[0].mark, Mark::Line);
        let svg = drawn.to_svg(Medium::Screen);
        assert!(
            svg.contains("synthetic recording") && svg.contains("\nmodel\n") && !svg.contains("\nmeasured\n")
        );
    }
}
