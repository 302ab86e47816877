//! Every figure for a screen, a column and a page: drawn, inside, small, the same every time, whatever it is
//! called and whether or not there is anything to show.

use crate::shown;

use crate::raster::{colliding, inked, near, rasterised, sound};
use crate::shown::{EMPTY, FULL, MEDIA};
use plain_charts::{Figure, MAX_HEIGHT_MM, Medium};
use wiperlab::figures::history::{self, TimeHistory};
use wiperlab::recording::motion_traces::MotionTraces;

const PLAIN: &str = "Actual blade fitted to its recording";
/// A script, quotes, an entity, Hebrew, Arabic, an emoji, a mark that turns the direction of writing, and a
/// control character.
const HOSTILE: &str = "<script>alert(1)</script> \"q\" & 'a' \u{5e9}\u{5dc}\u{5d5}\u{5dd} \u{645}\u{631}\u{62d}\u{628}\u{627} \u{1f697} \u{202e}evil ]]> \u{7}";

/// Every example of a list for every medium, with its name.
fn all(examples: &[shown::Example], name: &str) -> Vec<(String, String)> {
    let media = |(what, figure): &shown::Example| {
        let figure: Figure = figure(name);
        let what = *what;
        MEDIA.map(|(medium, of)| (format!("{what} for a {medium}"), figure.to_svg(of)))
    };
    examples.iter().flat_map(media).collect()
}

/// Pixels of the lines and words of the emptiest figure: its frame.
const FRAME: usize = 800;

#[test]
fn every_figure_is_drawn_and_keeps_to_itself() {
    for (name, svg) in all(&FULL, PLAIN) {
        sound(&name, &svg);
        assert!(inked(&rasterised(&svg)) > 5 * FRAME, "{name}: {}", inked(&rasterised(&svg)));
    }
    sound("animation", &shown::animation(PLAIN));
    assert!(inked(&rasterised(&shown::animation(PLAIN))) > 5 * FRAME);
}

#[test]
fn every_figure_in_print_fits_on_a_page() {
    for (what, figure) in FULL.iter().chain(&EMPTY) {
        for (medium, of) in MEDIA.into_iter().filter(|(_, of)| *of != Medium::Screen) {
            let svg = figure(PLAIN).to_svg(of);
            let height_mm: f64 = svg
                .split("height=\"")
                .nth(1)
                .and_then(|rest| rest.split("mm").next())
                .unwrap()
                .parse()
                .unwrap();
            assert!(height_mm <= MAX_HEIGHT_MM, "{what} for a {medium}: {height_mm} mm");
        }
    }
}

/// Of maps and ridges one below the other, the last of those over time alone has numbers and a title.
#[test]
fn panels_on_one_axis_of_time_are_numbered_once() {
    let (_, compared) = FULL.into_iter().find(|(what, _)| *what == "spectrograms compared").unwrap();
    let titles = |medium| compared(PLAIN).to_svg(medium).matches("\ntime, s\n").count();
    assert_eq!((titles(Medium::Column), titles(Medium::Page)), (1, 2));
}

#[test]
fn every_figure_of_nothing_is_a_frame() {
    for (name, svg) in all(&EMPTY, "") {
        sound(&name, &svg);
        let has_panels = svg.contains("<text"); // the labels of axes, where nothing has a name
        assert!(!has_panels || inked(&rasterised(&svg)) > FRAME, "{name}: {}", inked(&rasterised(&svg)));
    }
    sound("animation", &shown::still());
}

#[test]
fn names_stay_text_inside_every_figure_however_hostile_or_long() {
    let long = "a very long name of many words ".repeat(12);
    let unbroken = "Donaudampfschiff".repeat(20);
    for name in [HOSTILE, &long, &unbroken] {
        for (what, svg) in all(&FULL, name) {
            sound(&what, &svg);
            assert!(!svg.contains('\u{7}'), "{what}");
        }
        sound("animation", &shown::animation(name));
    }
}

#[test]
fn words_do_not_run_into_each_other() {
    for (name, svg) in all(&FULL, PLAIN) {
        assert_eq!(colliding(&svg), Vec::<[String; 2]>::new(), "{name}");
    }
    // the words for states and paces stand in one place, seen one at a time
    let svg = shown::animation(PLAIN);
    let in_turn = |pair: &[String; 2]| {
        ["tip: ", "times slower"].iter().any(|part| pair.iter().all(|word| word.contains(part)))
    };
    assert_eq!(
        colliding(&svg).into_iter().filter(|pair| !in_turn(pair)).collect::<Vec<_>>(),
        Vec::<[String; 2]>::new()
    );
}

#[test]
fn the_same_figure_gives_the_same_bytes() {
    assert_eq!(all(&FULL, HOSTILE), all(&FULL, HOSTILE));
    assert_eq!(shown::animation(HOSTILE), shown::animation(HOSTILE));
}

/// What a browser takes: as many values as times, which rise from 0 to at most 1.
#[test]
fn key_frames_of_the_animation_are_in_order_and_complete() {
    let svg = shown::animation(PLAIN);
    let list = |rest: &str, name: &str| -> Vec<String> {
        let (_, after) = rest.split_once(&format!("{name}=\"")).unwrap();
        after.split('"').next().unwrap().split(';').map(str::to_owned).collect()
    };
    let elements: Vec<&str> = svg.split("<animate").skip(1).collect();
    assert!(elements.len() > 15, "{}", elements.len());
    for element in elements {
        let times: Vec<f64> = list(element, "keyTimes").iter().map(|t| t.parse().unwrap()).collect();
        assert_eq!(times.len(), list(element, "values").len());
        assert!(
            times[0] == 0.0
                && times.windows(2).all(|pair| pair[0] <= pair[1])
                && times[times.len() - 1] <= 1.0,
            "{times:?}"
        );
        let discrete = element.split('>').next().unwrap().contains("discrete");
        assert!(
            discrete || times[times.len() - 1] == 1.0,
            "straight lines end with the animation: {times:?}"
        );
    }
}

const VERMILION: (u8, u8, u8) = (0xD5, 0x5E, 0x00);

#[test]
fn a_history_shows_the_model_only_when_there_is_one() {
    let motion = |shift_m: f64| {
        let time_s: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-4).collect();
        let wave =
            |scale: f64| time_s.iter().map(|t| Some(scale * (300.0 * t).sin() + shift_m)).collect::<Vec<_>>();
        MotionTraces {
            tip_x_m: wave(1e-3),
            head_x_m: wave(2e-3),
            deflection_m: wave(3e-3),
            head_drop_m: wave(1e-4),
            time_s,
        }
    };
    let both =
        TimeHistory { measured: Some(motion(0.0)), model: Some(motion(1e-3)), ..TimeHistory::default() };
    let model = |shown: &TimeHistory| {
        near(&rasterised(&history::draw_figure(shown).to_svg(Medium::Screen)), VERMILION)
    };
    assert!(model(&both) > 4000, "{}", model(&both));
    assert_eq!(model(&TimeHistory { model: None, ..both }), 0);
}
