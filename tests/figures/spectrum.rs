//! The figures of a spectrum analysis as pixels: drawn, coloured, inside the canvas, and frames when there is
//! nothing to show.

use crate::raster;

use crate::noise::noise;
use crate::raster::{drawn, inked, near, rasterised};
use plain_charts::Medium;
use short_spectra::{SampledRecord, SpectralAnalysis, SpectrumSettings};
use wiperlab::figures::analysis::compare_spectra;
use wiperlab::figures::ring_down::{self, ComponentDecay, RingDown, RingDownTrace};
use wiperlab::figures::spectrogram::{self, SpectrogramPlot, SpectrogramRidgePoint, SpeedPoint};
use wiperlab::figures::spectrum::{
    self, AmplitudeInterval, LabelledComponent, SpectraPlot, SpectrumCurve, SpectrumLevel,
};
use wiperlab::figures::windows::{self, WindowOverview, WindowSpan};

const VERMILION: (u8, u8, u8) = (0xD5, 0x5E, 0x00);
const BLUE: (u8, u8, u8) = (0x00, 0x72, 0xB2);
const NO_VALUE: (u8, u8, u8) = (0xE4, 0xE4, 0xE4);
const LOWEST: (u8, u8, u8) = (0x44, 0x01, 0x54);
const HIGHEST: (u8, u8, u8) = (0xFD, 0xE7, 0x25);

fn hz(count: u32) -> Vec<f64> {
    (0..count).map(|i| f64::from(i) * 5.0).collect()
}

fn spectra_shown() -> SpectraPlot {
    let frequency_hz = hz(400);
    let amplitude_m: Vec<f64> =
        frequency_hz.iter().map(|f| 1e-8 + 1e-5 * (-((f - 900.0) / 10.0).powi(2)).exp()).collect();
    let scaled = |factor: f64| amplitude_m.iter().map(|a| a * factor).collect::<Vec<_>>();
    let named = |frequency_hz, remark: &str| LabelledComponent {
        frequency_hz,
        frequency_sd_hz: 2.0,
        amplitude_m: 1e-5,
        amplitude_sd_m: 2e-6,
        range_hz: None,
        remark: remark.to_owned(),
    };
    SpectraPlot {
        title: "a <name> & more".to_owned(),
        quantity: "deflection".to_owned(),
        note: "0.1 s to 0.25 s; ".repeat(12),
        synthetic: true,
        interval_95: Some(AmplitudeInterval {
            frequency_hz: frequency_hz.clone(),
            lower_m: scaled(0.5),
            upper_m: scaled(2.0),
        }),
        noise_floor: Some(SpectrumLevel { frequency_hz: frequency_hz.clone(), amplitude_m: vec![1e-8; 400] }),
        leakage: Some(SpectrumLevel { frequency_hz: frequency_hz.clone(), amplitude_m: vec![2e-8; 400] }),
        components: vec![
            named(78.4, "weak"),
            named(100.0, "alias?"),
            named(900.0, ""),
            named(1990.0, "harmonic"),
        ],
        measured: Some(SpectrumCurve { frequency_hz, amplitude_m }),
        lowest_hz: 7.0,
        ..SpectraPlot::default()
    }
}

/// Cells of 10 um along a line of 10 nm noise, none in a tenth of the columns.
fn gram() -> SpectrogramPlot {
    let column = |i: u32| {
        (0..100)
            .map(|j| (!(40..50).contains(&i)).then(|| if j == 30 + i / 4 { 1e-5 } else { 1e-8 }))
            .collect()
    };
    let ridge = |i: u32| SpectrogramRidgePoint {
        time_s: f64::from(i) * 1e-3,
        frequency_hz: (!(40..50).contains(&i)).then(|| f64::from(30 + i / 4) * 5.0),
    };
    let speed = |i: u32| SpeedPoint {
        speed_m_per_s: f64::from(i) * 0.02,
        frequency_hz: f64::from(150 + i),
        frequency_sd_hz: Some(4.0),
    };
    SpectrogramPlot {
        title: "synthetic".to_owned(),
        quantity: "deflection".to_owned(),
        note: "sliding Hann window of 40 ms".to_owned(),
        synthetic: true,
        time_s: (0..100).map(|i| f64::from(i) * 1e-3).collect(),
        frequency_hz: hz(100),
        amplitude_m: (0..100).map(column).collect(),
        ridge: (0..100).map(ridge).collect(),
        instants: vec![("release".to_owned(), 0.02), ("reversal".to_owned(), 0.099)],
        over_speed: (1..9).map(speed).collect(),
        ..SpectrogramPlot::default()
    }
}

fn trace(amplitude_m: f64) -> RingDownTrace {
    let time_s: Vec<f64> = (0..500).map(|i| 0.5 + f64::from(i) * 2e-4).collect();
    RingDownTrace {
        displacement_m: time_s.iter().map(|t| Some(amplitude_m * (490.0 * t).sin())).collect(),
        time_s,
    }
}

fn ring() -> RingDown {
    let decay = ComponentDecay {
        name: "78.40(3) Hz, damping 5.0(1) %".to_owned(),
        fitted: trace(1e-5),
        envelope: trace(1e-5),
        data: trace(1e-5),
    };
    RingDown {
        quantity: "deflection".to_owned(),
        data: trace(1e-3),
        fitted: trace(1e-3),
        residual: trace(1e-6),
        noise_sd_m: Some(1e-6),
        decay: Some(decay),
        ..RingDown::default()
    }
}

fn whole() -> WindowOverview {
    let window = |name: &str, from_s, to_s| WindowSpan { name: name.to_owned(), from_s, to_s };
    let RingDownTrace { time_s, displacement_m } = trace(1e-3);
    WindowOverview {
        quantity: "deflection".to_owned(),
        head_x_m: displacement_m.clone(),
        channel_m: displacement_m,
        time_s,
        windows: vec![
            window("before", 0.5, 0.54),
            window("stick", 0.54, 0.55),
            window("flip", 0.55, 0.552),
            window("after", 0.552, 0.6),
        ],
        analysed_s: Some((0.56, 0.58)),
        ..WindowOverview::default()
    }
}

#[test]
fn a_spectrum_shows_its_components_and_keeps_its_text_inside() {
    let map = drawn(&spectrum::draw_figure(&spectra_shown()).to_svg(Medium::Screen));
    assert!(
        inked(&map) > 5000 && near(&map, BLUE) > 20 && near(&map, VERMILION) > 60,
        "{} {}",
        near(&map, BLUE),
        near(&map, VERMILION)
    );
    let bare = rasterised(
        &spectrum::draw_figure(&SpectraPlot { components: Vec::new(), ..spectra_shown() })
            .to_svg(Medium::Screen),
    );
    assert_eq!([near(&bare, BLUE), near(&bare, VERMILION)], [0, 0]);
}

#[test]
fn of_a_model_no_component_is_named_that_the_recording_could_not_show() {
    let analysed = |noise_m: f64| {
        let mut noise = noise(7);
        let tone = |hz: f64, t: f64| (std::f64::consts::TAU * hz * t).sin();
        let at = |t: f64, noise: f64| {
            1e-5 * tone(103.0, t) + 3e-8 * tone(311.0, t) + 1e-9 * tone(707.0, t) + noise_m * noise
        };
        let samples: Vec<Option<f64>> = (0..2000).map(|i| Some(at(f64::from(i) / 5000.0, noise()))).collect();
        SpectralAnalysis::from_record(
            &SampledRecord { samples: &samples, frame_rate_hz: 5000.0, exposure_s: None },
            &SpectrumSettings::default(),
        )
        .unwrap()
    };
    let named = |components: &[LabelledComponent]| {
        components.iter().map(|c| c.frequency_hz.round()).collect::<Vec<_>>()
    };
    let (recording, model) = (analysed(2e-6), analysed(0.0));
    assert!(model.spectrum.components.len() >= 3, "{:?}", model.spectrum.components);
    // a thousandth of the largest is of no account even where nothing was recorded
    assert_eq!(named(&compare_spectra(None, Some(&model)).model_components), [103.0, 311.0]);
    let beside = compare_spectra(Some(&recording), Some(&model));
    assert_eq!((named(&beside.components), named(&beside.model_components)), (vec![103.0], vec![103.0]));
}

#[test]
fn a_spectrogram_is_coloured_from_end_to_end_and_grey_where_there_is_nothing() {
    let shown = SpectrogramPlot { ridge: Vec::new(), over_speed: Vec::new(), ..gram() };
    let map = drawn(&spectrogram::draw_figure(&shown).to_svg(Medium::Screen));
    let all = map.pixels().len() as f64;
    let share = |colour| near(&map, colour) as f64 / all;
    // the map takes about 0.56 of the figure: nine tenths of it low, a tenth without a value, a hundredth
    // high
    assert!(
        (0.4..0.6).contains(&share(LOWEST)) && (0.04..0.08).contains(&share(NO_VALUE)),
        "{} {}",
        share(LOWEST),
        share(NO_VALUE)
    );
    assert!((0.003..0.02).contains(&share(HIGHEST)), "{}", share(HIGHEST));
    let ridge = drawn(&spectrogram::draw_figure(&gram()).to_svg(Medium::Screen));
    assert!(near(&ridge, VERMILION) > 300 && near(&map, VERMILION) == 0, "{}", near(&ridge, VERMILION));
}

#[test]
fn rows_stand_where_the_frequency_axis_says_linear_or_logarithmic() {
    // a line at 100 Hz between 10 and 1000 Hz: half way up a logarithmic axis, a tenth up a linear one
    let frequency_hz: Vec<f64> = (0..101).map(|j| f64::from(j) * 10.0).collect();
    let amplitude_m = vec![(0..101).map(|j| Some(if j == 10 { 1e-5 } else { 1e-8 })).collect(); 4];
    let height = |log_frequency| {
        let shown = SpectrogramPlot {
            time_s: vec![0.0, 0.1, 0.2, 0.3],
            frequency_hz: frequency_hz.clone(),
            amplitude_m: amplitude_m.clone(),
            ..SpectrogramPlot::default()
        };
        let map = rasterised(
            &spectrogram::draw_figure(&SpectrogramPlot {
                log_frequency,
                shown_hz: Some((10.0, 1000.0)),
                ..shown
            })
            .to_svg(Medium::Screen),
        );
        let column = map.width() / 2;
        let of = |y: u32| map.pixel(column, y).map(|p| (p.red(), p.green(), p.blue())).unwrap();
        let inside =
            |colour: (u8, u8, u8)| (0..map.height()).filter(|y| of(*y) == colour).collect::<Vec<_>>();
        let (low, high) = (inside(LOWEST), inside(HIGHEST));
        let middle = f64::from(high[0] + high[high.len() - 1]) / 2.0;
        let (top, bottom) = (f64::from(low[0]), f64::from(low[low.len() - 1]));
        (bottom - middle) / (bottom - top)
    };
    assert!((height(true) - 0.5).abs() < 0.01, "{}", height(true));
    assert!((height(false) - 90.0 / 990.0).abs() < 0.01, "{}", height(false));
}

#[test]
fn a_ring_down_and_the_windows_are_drawn_inside() {
    let map = drawn(&ring_down::draw_figure(&ring()).to_svg(Medium::Screen));
    assert!(inked(&map) > 10_000 && near(&map, VERMILION) > 500, "{} {}", inked(&map), near(&map, VERMILION));
    let map = drawn(&windows::draw_figure(&whole()).to_svg(Medium::Screen));
    // sky blue and green at 22 % on white
    assert!(
        near(&map, (0xDA, 0xEE, 0xFA)) > 20_000 && near(&map, (0xC7, 0xEA, 0xE0)) > 20_000,
        "{}",
        near(&map, (0xDA, 0xEE, 0xFA))
    );
}

#[test]
fn the_same_figures_give_the_same_bytes_and_are_small() {
    let figures = || {
        [
            spectrum::draw_figure(&spectra_shown()).to_svg(Medium::Screen),
            spectrogram::draw_figure(&gram()).to_svg(Medium::Screen),
            ring_down::draw_figure(&ring()).to_svg(Medium::Screen),
            windows::draw_figure(&whole()).to_svg(Medium::Screen),
        ]
    };
    assert_eq!(figures(), figures());
    assert!(figures().iter().all(|f| f.len() < 300_000), "{:?}", figures().map(|f| f.len()));
    let column: Vec<Option<f64>> = (0..700).map(|j| Some(1e-6 * f64::from(1 + j * 7919 % 1000))).collect();
    let large = SpectrogramPlot {
        time_s: (0..1300).map(f64::from).collect(),
        frequency_hz: hz(700),
        amplitude_m: vec![column; 1300],
        ..SpectrogramPlot::default()
    };
    assert!(
        spectrogram::draw_figure(&large).to_svg(Medium::Screen).len() < 400_000,
        "{}",
        spectrogram::draw_figure(&large).to_svg(Medium::Screen).len()
    );
}

#[test]
fn figures_of_nothing_are_frames() {
    assert!(
        inked(&drawn(&spectrogram::draw_figure(&SpectrogramPlot::default()).to_svg(Medium::Screen))) > 500
    );
    assert!(inked(&drawn(&ring_down::draw_figure(&RingDown::default()).to_svg(Medium::Screen))) > 500);
    assert!(inked(&drawn(&windows::draw_figure(&WindowOverview::default()).to_svg(Medium::Screen))) > 500);
    let unfilled = vec![vec![None; 100]; 100];
    assert!(
        inked(&drawn(
            &spectrogram::draw_figure(&SpectrogramPlot { amplitude_m: unfilled, ..gram() })
                .to_svg(Medium::Screen)
        )) > 500
    );
    let one = SpectrogramPlot { time_s: vec![0.1], amplitude_m: vec![vec![Some(1e-6); 100]], ..gram() };
    assert!(inked(&drawn(&spectrogram::draw_figure(&one).to_svg(Medium::Screen))) > 500);
    let ragged = SpectrogramPlot { amplitude_m: vec![vec![Some(1e-6)], Vec::new()], ..gram() };
    assert!(inked(&drawn(&spectrogram::draw_figure(&ragged).to_svg(Medium::Screen))) > 500);
}

#[test]
fn what_is_no_finite_number_never_reaches_a_figure() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, f64::MAX, 1e-320] {
        let named = LabelledComponent {
            frequency_hz: bad,
            frequency_sd_hz: bad,
            amplitude_m: bad,
            amplitude_sd_m: bad,
            range_hz: Some((bad, bad)),
            remark: String::new(),
        };
        let level = SpectrumLevel { frequency_hz: vec![bad, 5.0, 100.0], amplitude_m: vec![bad, bad, 1e-6] };
        let interval = AmplitudeInterval {
            frequency_hz: vec![10.0, bad, 900.0],
            lower_m: vec![bad, 1e-7, bad],
            upper_m: vec![1e-6, bad, bad],
        };
        let bad_spectra = SpectraPlot {
            components: vec![named],
            noise_floor: Some(level.clone()),
            leakage: Some(level),
            interval_95: Some(interval),
            ..spectra_shown()
        };
        raster::sound("figure", &spectrum::draw_figure(&bad_spectra).to_svg(Medium::Screen));
        let mut bad_gram = gram();
        bad_gram.amplitude_m[7] = vec![Some(bad); 100];
        bad_gram.ridge[3].frequency_hz = Some(bad);
        bad_gram.over_speed =
            vec![SpeedPoint { speed_m_per_s: bad, frequency_hz: bad, frequency_sd_hz: Some(bad) }];
        bad_gram.instants.push(("bad".to_owned(), bad));
        raster::sound("figure", &spectrogram::draw_figure(&bad_gram).to_svg(Medium::Screen));
        bad_gram.frequency_hz[5] = bad;
        bad_gram.time_s[99] = bad;
        bad_gram.log_frequency = true;
        raster::sound("figure", &spectrogram::draw_figure(&bad_gram).to_svg(Medium::Screen));
        let bad_trace =
            RingDownTrace { time_s: vec![bad, 0.1, 0.2], displacement_m: vec![Some(1e-3), Some(bad), None] };
        raster::sound(
            "figure",
            &ring_down::draw_figure(&RingDown {
                data: bad_trace.clone(),
                residual: bad_trace,
                noise_sd_m: Some(bad),
                ..ring()
            })
            .to_svg(Medium::Screen),
        );
        let mut bad_windows = WindowOverview { analysed_s: Some((bad, 0.58)), ..whole() };
        bad_windows.windows[1].from_s = bad;
        bad_windows.channel_m[9] = Some(bad);
        bad_windows.time_s[20] = bad;
        raster::sound("figure", &windows::draw_figure(&bad_windows).to_svg(Medium::Screen));
    }
}
