//! One example of every figure that the library draws, with a name of choice wherever a user's name may
//! stand, and one of nothing.

#[path = "fitted.rs"]
mod fitted;

use plain_charts::{Figure, Medium};
use wiperlab::figures::animation::{self, Animation, TrackedMotion};
use wiperlab::figures::animation::{PlaybackPace, PlaybackPart};
use wiperlab::figures::history::{self, TimeHistory};
use wiperlab::figures::profiles::{self, ProfilePlot};
use wiperlab::figures::ring_down::{self, ComponentDecay, RingDown, RingDownTrace};
use wiperlab::figures::spectrogram::{
    self, SpectrogramComparison, SpectrogramPlot, SpectrogramRidgePoint, SpectrogramSide, SpeedPoint,
    TargetFrequency,
};
use wiperlab::figures::spectrum::{self, LabelledComponent, SpectraPlot, SpectrumCurve, Target};
use wiperlab::figures::windows::{self, WindowOverview, WindowSpan};
use wiperlab::figures::work_precision::{self, WorkPrecision, WorkPrecisionRun};
use wiperlab::figures::{sweep_map, sweep_sheet};
use wiperlab::simulate::RunMotion;
use wiperlab::simulate::scene::Scene;
use wiperlab::sweep::{PointOutcome, Study};

/// An example: its name and what draws it, with a user's name in it.
pub type Example = (&'static str, fn(&str) -> Figure);

/// Every figure with something to show.
pub const FULL: [Example; 20] = [
    ("cycle over speed", fitted::cycle),
    ("pulls", fitted::pulls),
    ("corner", fitted::corner),
    ("residuals", fitted::residuals),
    ("evidence", fitted::evidence),
    ("history", |name| history::draw_figure(&full_history(name))),
    ("spectra", |name| spectrum::draw_figure(&full_spectra(name))),
    ("spectrogram", |name| spectrogram::draw_figure(&full_spectrogram(name))),
    ("spectrograms compared", |name| spectrogram::draw_comparison(&both_spectrograms(name))),
    ("ring-down", |name| ring_down::draw_figure(&full_ring_down(name))),
    ("windows", |name| windows::draw_figure(&full_windows(name))),
    ("work-precision", |name| work_precision::draw_figure(&full_work_precision(name))),
    ("map over one parameter", |name| sweep(name, 1)),
    ("map over two parameters", |name| sweep(name, 2)),
    ("sheet of one parameter", |name| sheet(name, 1)),
    ("sheet of two parameters", |name| sheet(name, 2)),
    ("profiles", fitted::profiles),
    ("poses", fitted::poses),
    ("stick-slip", fitted::stick_slip),
    ("friction law", fitted::law),
];

/// Every figure with nothing to show.
pub const EMPTY: [Example; 7] = [
    ("history", |_| history::draw_figure(&TimeHistory::default())),
    ("spectra", |_| spectrum::draw_figure(&SpectraPlot::default())),
    ("spectrogram", |_| spectrogram::draw_figure(&SpectrogramPlot::default())),
    ("ring-down", |_| ring_down::draw_figure(&RingDown::default())),
    ("windows", |_| windows::draw_figure(&WindowOverview::default())),
    ("work-precision", |_| work_precision::draw_figure(&WorkPrecision::default())),
    ("profiles", |_| profiles::draw_figure(&ProfilePlot::default())),
];

pub const MEDIA: [(&str, Medium); 3] =
    [("screen", Medium::Screen), ("column", Medium::Column), ("page", Medium::Page)];

const FRAMES: u32 = 1000;

fn times() -> Vec<f64> {
    (0..FRAMES).map(|i| 0.5 + f64::from(i) * 2e-4).collect()
}

/// A ring-down of 78 Hz with some frames missing.
fn wave(amplitude_m: f64) -> Vec<Option<f64>> {
    let missing = |i: &usize| i.is_multiple_of(97);
    let value = |t: f64| amplitude_m * (-5.0 * t).exp() * (490.0 * t).sin();
    times().into_iter().enumerate().map(|(i, t)| Some(value(t)).filter(|_| !missing(&i))).collect()
}

fn full_history(name: &str) -> TimeHistory {
    let motion = |scale: f64| wiperlab::recording::motion_traces::MotionTraces {
        time_s: times(),
        tip_x_m: wave(1e-2 * scale),
        head_x_m: wave(2e-2 * scale),
        deflection_m: wave(1e-3 * scale),
        head_drop_m: wave(1e-4 * scale),
    };
    TimeHistory {
        title: name.to_owned(),
        synthetic: true,
        measured: Some(motion(1.0)),
        model: Some(motion(1.1)),
        residual: Some(motion(0.1)),
        windows: vec![
            ("before".to_owned(), 0.5, 0.53),
            (name.to_owned(), 0.53, 0.6),
            ("after".to_owned(), 0.58, 0.61),
        ],
        stick_s: vec![(0.53, 0.58), (0.6, 0.601)],
        instants: vec![("hold".to_owned(), 0.53), (name.to_owned(), 0.55), ("release".to_owned(), 0.58)],
        frame_s: 2e-4,
    }
}

fn full_spectra(name: &str) -> SpectraPlot {
    let curve = |at: f64| {
        let frequency_hz: Vec<f64> = (0..2000).map(f64::from).collect();
        let amplitude_m =
            frequency_hz.iter().map(|f| 1e-8 + 1e-5 * (-((f - at) / 10.0).powi(2)).exp()).collect();
        SpectrumCurve { frequency_hz, amplitude_m }
    };
    let named = |frequency_hz, remark: &str| LabelledComponent {
        frequency_hz,
        frequency_sd_hz: 2.0,
        amplitude_m: 1e-5,
        amplitude_sd_m: 2e-6,
        range_hz: Some((frequency_hz - 9.0, frequency_hz + 9.0)),
        remark: remark.to_owned(),
    };
    SpectraPlot {
        title: name.to_owned(),
        quantity: "deflection".to_owned(),
        note: name.to_owned(),
        synthetic: true,
        noise_floor_m: Some(1e-8),
        measured: Some(curve(900.0)),
        model: Some(curve(850.0)),
        targets: vec![Target { name: name.to_owned(), frequency_hz: 900.0, frequency_sd_hz: Some(20.0) }],
        components: vec![named(78.4, ""), named(900.0, name)],
        model_components: vec![named(80.1, ""), named(850.0, name)],
        lowest_hz: 7.0,
        ..SpectraPlot::default()
    }
}

fn aimed(name: &str, frequency_hz: f64, span_s: (f64, f64), met: bool) -> TargetFrequency {
    TargetFrequency { name: name.to_owned(), frequency_hz, frequency_sd_hz: Some(5.0), span_s, met }
}

fn full_spectrogram(name: &str) -> SpectrogramPlot {
    let column = |i: u32| {
        (0..100)
            .map(|j| (!(40..50).contains(&i)).then(|| if j == 30 + i / 4 { 1e-5 } else { 1e-8 }))
            .collect()
    };
    let ridge = |i: u32| SpectrogramRidgePoint {
        time_s: f64::from(i) * 1e-3,
        frequency_hz: (!(40..50).contains(&i)).then(|| f64::from(30 + i / 4) * 5.0),
    };
    SpectrogramPlot {
        title: name.to_owned(),
        quantity: "deflection".to_owned(),
        note: name.to_owned(),
        synthetic: true,
        time_s: (0..100).map(|i| f64::from(i) * 1e-3).collect(),
        frequency_hz: (0..100).map(|i| f64::from(i) * 5.0).collect(),
        amplitude_m: (0..100).map(column).collect(),
        ridge: (0..100).map(ridge).collect(),
        targets: vec![
            aimed(name, 200.0, (0.01, 0.06), true),
            aimed("high at speed", 230.0, (0.05, 0.09), false),
        ],
        instants: vec![(name.to_owned(), 0.02), ("reversal".to_owned(), 0.099)],
        ..SpectrogramPlot::default()
    }
}

/// A recording and a model that starts and ends a little later.
fn both_spectrograms(name: &str) -> SpectrogramComparison {
    let speed = |i: u32| SpeedPoint {
        speed_m_per_s: 1e-3 * f64::from(i),
        frequency_hz: 150.0 + f64::from(i),
        frequency_sd_hz: Some(5.0),
    };
    let measured = SpectrogramPlot { over_speed: (0..40).map(speed).collect(), ..full_spectrogram(name) };
    let later = |time_s: &mut f64| *time_s += 5e-3;
    let mut model = measured.clone();
    model.time_s.iter_mut().for_each(later);
    model.ridge.iter_mut().map(|p| &mut p.time_s).for_each(later);
    let sides = vec![(SpectrogramSide::Measured, measured), (SpectrogramSide::Model, model)];
    SpectrogramComparison { title: name.to_owned(), note: name.to_owned(), synthetic: true, sides }
}

fn full_ring_down(name: &str) -> RingDown {
    let trace = |amplitude_m| RingDownTrace { time_s: times(), displacement_m: wave(amplitude_m) };
    let decay = ComponentDecay {
        name: name.to_owned(),
        fitted: trace(1e-5),
        envelope: trace(1e-5),
        data: trace(1e-5),
    };
    RingDown {
        title: name.to_owned(),
        quantity: "deflection".to_owned(),
        data: trace(1e-3),
        fitted: trace(1e-3),
        residual: trace(1e-6),
        noise_sd_m: Some(1e-6),
        decay: Some(decay),
        ..RingDown::default()
    }
}

fn full_windows(name: &str) -> WindowOverview {
    let window = |name: &str, from_s, to_s| WindowSpan { name: name.to_owned(), from_s, to_s };
    WindowOverview {
        title: name.to_owned(),
        quantity: "deflection".to_owned(),
        head_x_m: wave(1e-2),
        channel_m: wave(1e-3),
        time_s: times(),
        windows: vec![window("before", 0.5, 0.54), window(name, 0.54, 0.58), window("after", 0.58, 0.7)],
        analysed_s: Some((0.6, 0.65)),
        ..WindowOverview::default()
    }
}

fn full_work_precision(name: &str) -> WorkPrecision {
    let point = |method: &str, i: i32| WorkPrecisionRun {
        method: method.to_owned(),
        wall_s: 1e-3 * 2.0_f64.powi(i),
        error: (i > 0).then(|| 10.0_f64.powi(-2 * i)),
        wrong_transitions: if i < 2 { 20 } else { 0 },
    };
    WorkPrecision {
        title: name.to_owned(),
        subtitle: name.to_owned(),
        error_label: "error of transition times, s".to_owned(),
        points: [name, "slack", "taylor"]
            .iter()
            .flat_map(|method| (0..6).map(|i| point(method, i)))
            .collect(),
        floor: Some(1e-9),
    }
}

/// A map of a parameter study over so many parameters; a cell in seven has no value.
fn sweep(name: &str, axes: usize) -> Figure {
    let (study, outcomes) = swept(name, axes);
    sweep_map::draw_figure(&study, &scene(), &outcomes, 0)
}

/// The same map on a sheet.
fn sheet(name: &str, axes: usize) -> Figure {
    let (study, outcomes) = swept(name, axes);
    sweep_sheet::draw_figure(&study, &scene(), &outcomes)
}

fn swept(name: &str, axes: usize) -> (Study, Vec<PointOutcome>) {
    let axis = |name: &str| format!("[[axis]]\nname = \"{name}\"\nfrom = 0.1\nto = 0.4\npoints = 12\n");
    let axes: String = ["friction.a", "friction.c"][..axes].iter().map(|name| axis(name)).collect();
    let name = serde_json::to_string(name).unwrap(); // a JSON string is a TOML string
    let head = format!(
        "format = 1\ntitle = {name}\nscene = \"s\"\n[camera]\nframe_rate_hz = 1e4\nexposure_s = 0.0\n"
    );
    let text = format!("{head}{axes}[[map]]\nname = {name}\nkind = \"stick-fraction\"\n");
    let study = Study::parse("study", &text).unwrap();
    let value = |i: usize| PointOutcome {
        ended: None,
        stopped_at_s: Some(1.0),
        values: if i % 7 == 3 { Vec::new() } else { vec![Ok(0.01 * i as f64)] },
    };
    let outcomes: Vec<PointOutcome> = (0..study.point_count()).map(value).collect();
    (study, outcomes)
}

fn scene() -> Scene {
    Scene::parse("actual-blade", include_str!("../../data/scenes/actual-blade.toml")).unwrap()
}

/// The animation of the committed blade, with its own motion as what was measured.
pub fn animation(name: &str) -> String {
    let motion = RunMotion::simulate(&scene());
    let hold = motion.stick_s.iter().copied().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0]))).unwrap();
    let pace = PlaybackPace::around_hold(hold, [0.56, 1.15]).unwrap();
    let [from_s, to_s] = pace.span_s();
    let samples: Vec<_> =
        motion.samples.iter().filter(|s| s.time_s >= from_s && s.time_s <= to_s).copied().collect();
    let seen = |of: fn(&wiperlab::simulate::ModelSample) -> f64| {
        samples.iter().enumerate().map(|(i, s)| (i % 50 != 7).then(|| of(s))).collect()
    };
    let measured = TrackedMotion {
        time_s: samples.iter().map(|s| s.time_s).collect(),
        tip_x_m: seen(|s| s.tip_x_m),
        head_x_m: seen(|s| s.head_x_m),
        head_drop_m: seen(|s| s.head_drop_m),
    };
    let inside =
        motion.transitions.iter().filter(|t| t.time_s > from_s && t.time_s <= to_s).map(|t| (t.time_s, t.to));
    let modes = std::iter::once((from_s, samples[0].mode)).chain(inside).collect();
    animation::render_svg(&Animation {
        title: name.to_owned(),
        synthetic: true,
        turns: true,
        linkage: motion.linkage,
        modes,
        stick_s: motion.stick_s.iter().filter(|[from, to]| *to > from_s && *from < to_s).copied().collect(),
        hold_s: hold,
        measured: Some(measured),
        samples,
        pace,
    })
}

/// An animation of nothing.
pub fn still() -> String {
    animation::render_svg(&Animation {
        title: String::new(),
        synthetic: false,
        turns: true,
        linkage: scene().linkage,
        samples: Vec::new(),
        modes: Vec::new(),
        stick_s: Vec::new(),
        hold_s: [0.0, 0.1],
        measured: None,
        pace: PlaybackPace { parts: vec![PlaybackPart { from_s: 0.0, to_s: 0.1, slower: 100.0 }] },
    })
}
