//! Every figure as pixels: it can be drawn, is not blank, and its colours are there.

use resvg::{tiny_skia, usvg};
use wiperlab::report::history::{self, History, Motion};
use wiperlab::report::spectra::{self, Curve, Spectra, Target};

/// Counts of pixels that are not white, and of pixels near the colour of the model.
fn pixels(svg: &str) -> (usize, usize) {
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default()).expect("well-formed SVG");
    let size = tree.size().to_int_size();
    let mut map = tiny_skia::Pixmap::new(size.width(), size.height()).unwrap();
    resvg::render(&tree, tiny_skia::Transform::default(), &mut map.as_mut());
    let near = |a: u8, b: u8| a.abs_diff(b) < 24;
    let inked = map.pixels().iter().filter(|p| p.red() < 250 || p.green() < 250 || p.blue() < 250).count();
    let model = map.pixels().iter().filter(|p| near(p.red(), 0xD5) && near(p.green(), 0x5E) && near(p.blue(), 0x00)).count();
    (inked, model)
}

fn motion(shift_m: f64) -> Motion {
    let time_s: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-4).collect();
    let wave = |scale: f64| time_s.iter().map(|t| Some(scale * (300.0 * t).sin() + shift_m)).collect::<Vec<_>>();
    Motion { tip_x_m: wave(1e-3), head_x_m: wave(2e-3), deflection_m: wave(3e-3), head_drop_m: wave(1e-4), time_s }
}

#[test]
fn a_history_shows_the_model_only_when_there_is_one() {
    let both = History { measured: Some(motion(0.0)), model: Some(motion(1e-3)), zoom_s: Some((0.05, 0.1)), ..History::default() };
    let (inked, model) = pixels(&history::figure(&both));
    assert!(inked > 10_000 && model > 1000, "{inked} {model}");
    assert_eq!(pixels(&history::figure(&History { model: None, ..both })).1, 0);
}

#[test]
fn a_spectrum_is_not_blank() {
    let curve = |at: f64| {
        let frequency_hz: Vec<f64> = (0..2000).map(f64::from).collect();
        let amplitude_m = frequency_hz.iter().map(|f| 1e-8 + 1e-5 * (-((f - at) / 10.0).powi(2)).exp()).collect();
        Curve { frequency_hz, amplitude_m, components_hz: vec![at] }
    };
    let target = Target { name: "high".to_owned(), frequency_hz: 900.0, frequency_sd_hz: Some(20.0) };
    let both = Spectra {
        measured: Some(curve(900.0)),
        model: Some(curve(850.0)),
        targets: vec![target],
        noise_floor_m: Some(1e-8),
        lowest_hz: 7.0,
        ..Spectra::default()
    };
    let (inked, model) = pixels(&spectra::figure(&both));
    assert!(inked > 5000 && model > 100, "{inked} {model}");
}

#[test]
fn figures_of_nothing_are_frames() {
    assert!(pixels(&history::figure(&History::default())).0 > 1000);
    assert!(pixels(&spectra::figure(&Spectra::default())).0 > 500);
}
