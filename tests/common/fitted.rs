//! Examples of the figures of a fit and of the fitted model's own motion, with a name of choice wherever a
//! user's name may stand.

use super::scene;
use plain_charts::{Colour, Figure, ShadedSpan};
use wiperlab::figures::corner::{self, CornerParameter, CornerPlot};
use wiperlab::figures::cycle::{self, CycleOverSpeed, RecordedCycle, SpeedPoint, Target};
use wiperlab::figures::evidence;
use wiperlab::figures::friction::{self, FrictionPlot};
use wiperlab::figures::poses::{self, PoseSequence};
use wiperlab::figures::profiles::{self, ParameterProfile, ProfilePlot};
use wiperlab::figures::pulls::{self, Pull, PullPlot};
use wiperlab::figures::residuals::{self, ResidualDiagnostics};
use wiperlab::figures::stick_slip::{self, StickSlipPart, StickSlipSheet, TipFriction};
use wiperlab::fit::uncertainty::ParameterVerdict;

/// A parameter that is known, one that is open at an end, and one without intervals.
pub fn profiles(name: &str) -> Figure {
    let points = |width: f64| {
        (0..9)
            .map(|i| 0.1 + 0.02 * f64::from(i))
            .map(|x| (x, ((x - 0.18) / width).powi(2)))
            .collect::<Vec<_>>()
    };
    let profile = |symbol: &str, intervals| ParameterProfile {
        symbol: symbol.to_owned(),
        unit: "s/m".to_owned(),
        verdict: ParameterVerdict::Identified,
        bounds: (0.05, 0.4),
        estimate: 0.18,
        truth: Some(0.19),
        points: points(0.03),
        linear: points(0.04),
        stated: [Some(0.1), None],
        intervals,
    };
    let known = Some([Some(0.15), Some(0.21)]);
    profiles::draw_figure(&ProfilePlot {
        title: name.to_owned(),
        synthetic: true,
        least_cost: 0.03,
        threshold: 3.84,
        parameters: vec![
            profile("A", [known, known, known]),
            profile("B", [Some([Some(0.1), None]), known, None]),
            profile("blade.neck_stiffness_n_m_per_rad", [None, None, None]),
        ],
    })
}

pub fn poses(name: &str) -> Figure {
    poses::draw_figure(
        &PoseSequence::from_motion(&wiperlab::simulate::RunMotion::simulate(&scene()), name, name.to_owned())
            .unwrap(),
    )
}

/// Two parts, one of them with measured velocities.
pub fn stick_slip(name: &str) -> Figure {
    let angles = || (0..200).map(|i| f64::from(i) * 0.1);
    let velocity = |scale: f64| angles().map(|a| Some((1e-3 * a, 0.1 * scale * a.sin()))).collect::<Vec<_>>();
    let state = |a: f64| TipFriction {
        velocity_m_per_s: 0.1 * a.sin(),
        deflection_m: 1e-3 * a.cos(),
        friction_n: 0.05 * a.sin().signum(),
    };
    let part = |name: &str, measured| StickSlipPart {
        name: name.to_owned(),
        span_s: (0.0, 0.02),
        measured,
        model: velocity(1.0),
        friction: angles().map(state).map(Some).collect(),
        measured_friction: angles().step_by(9).map(state).map(Some).collect(),
        law: vec![Some((0.0, 0.05)), Some((0.1, 0.04))],
        sticks: vec![ShadedSpan::new("tip sticks (model)", Colour::Black, 0.003, 0.006)],
    };
    let parts = vec![part(name, velocity(1.1)), part("after the flip", Vec::new())];
    stick_slip::draw_figure(&StickSlipSheet {
        title: name.to_owned(),
        note: name.to_owned(),
        synthetic: true,
        friction_label: "friction, model".to_owned(),
        parts,
    })
}

pub fn law(name: &str) -> Figure {
    let speeds = || (0..100).map(|i| 2e-3 * f64::from(i));
    let coefficient = |v: f64| 0.1 * (-5.0 * v).exp() + 0.3;
    friction::draw_figure(&FrictionPlot {
        title: name.to_owned(),
        note: name.to_owned(),
        synthetic: true,
        curve: speeds().map(|v| (v, coefficient(v))).collect(),
        visited: Some((0.0, 0.15)),
        interval_95: speeds().map(|v| (v, coefficient(v) - 0.01, coefficient(v) + 0.02)).collect(),
        even: speeds().take(75).map(|v| (v, coefficient(v))).collect(),
        truth: speeds().map(|v| (v, coefficient(v) + 0.01)).collect(),
        others: vec![("rational law".to_owned(), speeds().map(|v| (v, 0.4 / (1.0 + v))).collect())],
        shares: (0..10).map(f64::from).map(|i| (0.02 * i, 0.02 * i + 0.02, 0.01 * i)).collect(),
        head: Some(0.08),
    })
}

/// A course of a thousand frames of which some are lost, whole and enlarged.
pub fn evidence(name: &str) -> Figure {
    let course = |scale: f64| {
        let point = |i: u32| (i % 97 != 5).then(|| (1e-3 * f64::from(i), scale * (0.1 * f64::from(i)).sin()));
        (0..1000).map(point).collect::<Vec<_>>()
    };
    let part = |name: &str, span_s: (f64, f64)| {
        let inside = |course: Vec<Option<(f64, f64)>>| {
            course.into_iter().filter(|p| p.is_none_or(|p| p.0 >= span_s.0 && p.0 <= span_s.1)).collect()
        };
        evidence::EvidencePart {
            name: name.to_owned(),
            span_s,
            measured: inside(course(1e-3)),
            model: inside(course(1.1e-3)),
            residual: inside(course(5.0)),
            rms: 3.5,
            sticks: Vec::new(),
            remark: String::new(),
        }
    };
    evidence::draw_figure(&evidence::EvidencePlot {
        title: name.to_owned(),
        synthetic: true,
        quantity: "deflection".to_owned(),
        parts: vec![
            part("whole recording", (0.0, 1.0)),
            part(name, (0.3, 0.335)),
            part("late", (0.8, 0.815)),
        ],
        ..evidence::EvidencePlot::default()
    })
}

/// A cycle that falls with the speed, among natural frequencies and a target.
pub fn cycle(name: &str) -> Figure {
    let points = |by: f64| {
        let point = |i: u32| SpeedPoint {
            speed_m_per_s: 0.005 * f64::from(i),
            frequency_hz: 900.0 - by * f64::from(i),
            frequency_sd_hz: Some(6.0),
        };
        (1..40).map(point).collect()
    };
    cycle::draw_figure(&CycleOverSpeed {
        title: name.to_owned(),
        synthetic: true,
        recordings: vec![RecordedCycle { name: String::new(), measured: points(5.0), model: points(4.5) }],
        natural_hz: vec![("neck".to_owned(), 195.0), ("lip".to_owned(), 608.0)],
        targets: vec![Target { name: name.to_owned(), frequency_hz: 908.0, frequency_sd_hz: Some(4.0) }],
        ..CycleOverSpeed::default()
    })
}

/// Features that are met, missed and predicted.
pub fn pulls(name: &str) -> Figure {
    let pull = |name: &str, deviations, held_out| Pull { name: name.to_owned(), deviations, held_out };
    pulls::draw_figure(&PullPlot {
        title: name.to_owned(),
        synthetic: true,
        pulls: vec![pull("low", -0.3, false), pull(name, 2.4, false), pull("release", 1.1, true)],
        without: Vec::new(),
    })
}

/// Three parameters, one of them open and without a linear interval.
pub fn corner(name: &str) -> Figure {
    let known = |estimate: f64| CornerParameter {
        symbol: "A".to_owned(),
        words: "0.108\n0.107 to 0.109".to_owned(),
        estimate,
        stated: [Some(estimate - 0.02), Some(estimate + 0.02)],
        sd: Some(0.01),
        prior: Some((estimate, 0.02)),
        truth: Some(estimate + 0.005),
        profile: vec![(estimate - 0.02, 0.14), (estimate, 1.0), (estimate + 0.02, 0.14)],
        optima: vec![(estimate, true), (estimate + 0.01, true), (estimate - 0.02, false)],
    };
    let open = CornerParameter { sd: None, stated: [None, Some(0.9)], symbol: name.to_owned(), ..known(0.7) };
    let row = |a: f64, b: f64| vec![Some(a), Some(b), None];
    corner::draw_figure(&CornerPlot {
        title: name.to_owned(),
        synthetic: true,
        parameters: vec![known(0.4), known(0.5), open],
        correlations: vec![row(1.0, -0.9), row(-0.9, 1.0), vec![None; 3]],
    })
}

/// A residual with a memory, and segments that fit worse the longer they are.
pub fn residuals(name: &str) -> Figure {
    residuals::draw_figure(&ResidualDiagnostics {
        title: name.to_owned(),
        note: name.to_owned(),
        synthetic: true,
        histogram: (0..40).map(|i| (-4.0 + 0.2 * f64::from(i), -3.8 + 0.2 * f64::from(i), 0.1)).collect(),
        correlation: (1..60).map(|i| (2e-4 * f64::from(i), (0.3 * f64::from(i)).cos())).collect(),
        white_95: 0.04,
        spectrum: (1..300).map(|i| (8.0 * f64::from(i), 1.0 + f64::from(i % 9))).collect(),
        growth: vec![(0.004, 1.0), (0.008, 1.1), (0.016, 1.4)],
    })
}
