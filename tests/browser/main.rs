//! The page and the figures in a browser: nothing is asked of the network, nothing is cut off, dark and
//! light, on screen and on paper.
//!
//! These tests need Chromium, named by the variable CHROMIUM or found on PATH: `cargo test --test browser --
//! --ignored`.

#[path = "../common/browser.rs"]
mod driver;
#[path = "../common/files.rs"]
mod files;
#[path = "../common/hostile.rs"]
mod hostile;
#[path = "../common/project.rs"]
mod project;
#[path = "../common/small_fit.rs"]
#[allow(dead_code, reason = "what is written is read by the browser here")]
mod small_fit;

use driver::Browser;
use files::files;
use project::Project;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

const TWIN: &str = "actual-blade-twin";
const PUBLISHED: &str = "published-experiment";

/// The folder of the report of a fit, made anew.
fn report(project: &Project, fit: &str) -> PathBuf {
    project.run_to(&["report", &format!("fits/{fit}")], &[0]);
    project.path("reports").join(fit)
}

/// What the page complained of: the console, the browser's own log, exceptions.
fn complaints(browser: &Browser) -> Vec<String> {
    let loud = |level: &Value| matches!(level.as_str(), Some("error" | "warning" | "assert"));
    let console = browser.reported("Runtime.consoleAPICalled").into_iter().filter(|e| loud(&e["type"]));
    let log = browser.reported("Log.entryAdded").into_iter().filter(|e| loud(&e["entry"]["level"]));
    let thrown = browser.reported("Runtime.exceptionThrown").into_iter();
    let dialogs = browser.reported("Page.javascriptDialogOpening").into_iter();
    console.chain(log).chain(thrown).chain(dialogs).map(Value::to_string).collect()
}

/// What was asked of the network or the disk, but for what the document holds itself.
fn requests(browser: &Browser) -> Vec<String> {
    let urls = browser
        .reported("Network.requestWillBeSent")
        .into_iter()
        .filter_map(|e| e["request"]["url"].as_str().map(str::to_owned));
    urls.filter(|url| !url.starts_with("data:")).collect()
}

#[test]
#[ignore = "needs Chromium: cargo test --test browser -- --ignored"]
fn a_page_asks_for_nothing_and_complains_of_nothing() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    for fit in [TWIN, PUBLISHED] {
        browser.open(&report(&project, fit).join("index.html"));
        assert_eq!(complaints(&browser), Vec::<String>::new(), "{fit}");
        assert_eq!(requests(&browser).len(), 1, "{fit}: {:?}", requests(&browser));
        assert_eq!(
            browser.evaluate("document.querySelectorAll('script, link, iframe, object, embed, img').length"),
            0,
            "{fit}"
        );
        assert!(
            browser.evaluate("document.querySelectorAll('figure svg').length").as_u64().unwrap() >= 3,
            "{fit}"
        );
    }
}

#[test]
#[ignore = "needs Chromium: cargo test --test browser -- --ignored"]
fn a_page_fits_a_telephone_and_a_wide_screen() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    let page = report(&project, TWIN).join("index.html");
    for width in [400, 1600] {
        browser.resize(width, 900);
        browser.open(&page);
        let [content, window] = ["scrollWidth", "clientWidth"]
            .map(|name| browser.evaluate(&format!("document.documentElement.{name}")));
        assert_eq!(window, width);
        assert!(content.as_u64().unwrap() <= window.as_u64().unwrap(), "{width}: {content} wide");
    }
}

#[test]
#[ignore = "needs Chromium: cargo test --test browser -- --ignored"]
fn a_page_of_several_fits_is_as_quiet_and_as_narrow() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    project.run_to(
        &["report", &format!("fits/{TWIN}"), &format!("fits/{PUBLISHED}"), "--out", "reports/both"],
        &[0],
    );
    for width in [400, 1600] {
        browser.resize(width, 900);
        browser.open(&project.path("reports/both/index.html"));
        assert_eq!(complaints(&browser), Vec::<String>::new());
        assert_eq!(requests(&browser).len(), 1, "{:?}", requests(&browser));
        assert!(
            browser.evaluate("document.documentElement.scrollWidth").as_u64().unwrap() <= u64::from(width),
            "{width}"
        );
        assert_eq!(browser.evaluate(TEXTS_OUTSIDE), json!([]));
        assert!(browser.evaluate("document.querySelectorAll('figure svg').length").as_u64().unwrap() >= 1);
    }
}

/// Shares of the pixels of a screenshot that are dark and light, of the whole window or of an element of the
/// page.
fn dark_and_light(browser: &mut Browser, element: Option<&str>) -> (f64, f64) {
    let clip = element.map(|selector| {
        let of =
            format!("(() => {{ const r = document.querySelector('{selector}').getBoundingClientRect(); ");
        let mut clip = browser.evaluate(&format!(
            "{of} return {{x: r.x + scrollX, y: r.y + scrollY, width: r.width, height: r.height}}; }})()"
        ));
        clip["scale"] = json!(1);
        clip
    });
    let whole = json!({"format": "png", "captureBeyondViewport": true});
    let parameters = clip
        .map_or(whole.clone(), |clip| json!({"format": "png", "captureBeyondViewport": true, "clip": clip}));
    let picture = browser.call("Page.captureScreenshot", parameters)["data"].as_str().unwrap().to_owned();
    let counted = browser.evaluate(&format!(
        "(async () => {{
            const image = new Image();
            image.src = 'data:image/png;base64,{picture}';
            await image.decode();
            const canvas = document.createElement('canvas');
            [canvas.width, canvas.height] = [image.width, image.height];
            const context = canvas.getContext('2d');
            context.drawImage(image, 0, 0);
            const pixels = context.getImageData(0, 0, image.width, image.height).data;
            let [dark, light] = [0, 0];
            for (let i = 0; i < pixels.length; i += 4) {{
                const mean = (pixels[i] + pixels[i + 1] + pixels[i + 2]) / 3;
                if (mean < 70) dark += 4;
                if (mean > 190) light += 4;
            }}
            return [dark / pixels.length, light / pixels.length];
        }})()"
    ));
    (counted[0].as_f64().unwrap(), counted[1].as_f64().unwrap())
}

/// Mean of red, green and blue of a computed colour.
fn brightness(browser: &mut Browser, property: &str) -> f64 {
    let colour = browser.evaluate(&format!("getComputedStyle(document.body).{property}"));
    let numbers: Vec<f64> = colour
        .as_str()
        .unwrap()
        .split(|c: char| !(c.is_ascii_digit() || c == '.'))
        .filter_map(|n| n.parse().ok())
        .collect();
    numbers[..3].iter().sum::<f64>() / 3.0
}

#[test]
#[ignore = "needs Chromium: cargo test --test browser -- --ignored"]
fn page_and_figures_follow_the_readers_light() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    let page = report(&project, TWIN).join("index.html");
    browser.resize(1000, 900);
    for (scheme, is_dark) in [("light", false), ("dark", true)] {
        browser.prefer(scheme);
        browser.open(&page);
        let (ground, text) = (brightness(&mut browser, "backgroundColor"), brightness(&mut browser, "color"));
        assert_eq!(
            (ground < 80.0, text > 170.0),
            (is_dark, is_dark),
            "{scheme}: ground {ground}, text {text}"
        );
        let figures = browser.evaluate("document.querySelectorAll('figure').length").as_u64().unwrap();
        for figure in 1..=figures {
            let (dark, light) = dark_and_light(&mut browser, Some(&format!("#figure-{figure} svg")));
            let (ground, ink) = if is_dark { (dark, light) } else { (light, dark) };
            assert!(
                ground > 0.5 && ink > 0.002 && ink < 0.4,
                "{scheme}, figure {figure}: ground {ground:.3}, ink {ink:.3}"
            );
        }
    }
}

/// Texts of the SVGs of a document that leave their SVG by more than half a pixel.
const TEXTS_OUTSIDE: &str = "[...document.querySelectorAll('svg')].flatMap(svg => {
    const box = svg.getBoundingClientRect();
    const leaves = r => r.left < box.left - 0.5 || r.right > box.right + 0.5 || r.top < box.top - 0.5 || r.bottom > box.bottom + 0.5;
    return [...svg.querySelectorAll('text')].filter(t => leaves(t.getBoundingClientRect())).map(t => t.textContent);
})";

#[test]
#[ignore = "needs Chromium: cargo test --test browser -- --ignored"]
fn text_stays_inside_every_figure_on_screen_and_in_print() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    let known = project.path("known.svg");
    std::fs::write(&known, "<svg xmlns='http://www.w3.org/2000/svg' width='90' height='40'><text y='30'>in</text><text x='80' y='30'>out</text></svg>")
        .unwrap();
    browser.open(&known);
    assert_eq!(browser.evaluate(TEXTS_OUTSIDE), json!(["out"]));
    for fit in [TWIN, PUBLISHED] {
        let folder = report(&project, fit);
        let figures = [files(&folder, "svg"), files(&folder.join("paper"), "svg")].concat();
        assert!(figures.len() >= 6, "{fit}: {figures:?}");
        for file in figures {
            browser.open(&file);
            assert_eq!(browser.evaluate(TEXTS_OUTSIDE), json!([]), "{}", file.display());
            assert_eq!(complaints(&browser), Vec::<String>::new(), "{}", file.display());
        }
        browser.open(&folder.join("index.html"));
        assert_eq!(browser.evaluate(TEXTS_OUTSIDE), json!([]), "{fit}");
    }
}

#[test]
#[ignore = "needs Chromium: cargo test --test browser -- --ignored"]
fn a_page_prints_on_a_sane_number_of_pages() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    browser.open(&report(&project, TWIN).join("index.html"));
    let document = browser
        .call("Page.printToPDF", json!({"printBackground": true, "paperWidth": 8.27, "paperHeight": 11.69}));
    let data = document["data"].as_str().unwrap().to_owned();
    let pages = browser
        .evaluate(&format!("atob('{data}').match(/\\/Type\\s*\\/Page\\b(?!s)/g).length"))
        .as_u64()
        .unwrap();
    let figures = browser.evaluate("document.querySelectorAll('figure').length").as_u64().unwrap();
    assert!((3..=2 * figures + 6).contains(&pages), "{pages} pages for {figures} figures");
}

#[test]
#[ignore = "needs Chromium: cargo test --test browser -- --ignored"]
fn hostile_names_are_shown_as_text() {
    let (project, mut browser) = (hostile::project(), Browser::start());
    browser.open(&project.path("reports").join(hostile::FIT).join("index.html"));
    assert_eq!(complaints(&browser), Vec::<String>::new());
    assert_eq!(requests(&browser).len(), 1, "{:?}", requests(&browser));
    assert_eq!(
        browser
            .evaluate("document.querySelectorAll('script, [onload], [onerror], [onclick], body b').length"),
        0
    );
    assert_eq!(browser.evaluate("typeof window.broken"), "undefined");
    let text = browser.evaluate("document.body.textContent");
    for name in hostile::NAMES {
        // what would turn the direction of the text after it is left out
        let shown = name.replace('\u{202e}', "");
        assert!(text.as_str().unwrap().contains(&shown), "{shown:?}");
    }
    assert_eq!(browser.evaluate("document.title"), hostile::TITLE);
    assert_eq!(browser.evaluate(TEXTS_OUTSIDE), json!([]));
    for file in files(&project.path("reports").join(hostile::FIT), "svg") {
        browser.open(&file);
        assert_eq!(complaints(&browser), Vec::<String>::new(), "{}", file.display());
        assert_eq!(
            browser.evaluate("document.querySelectorAll('script, [onload], parsererror').length"),
            0,
            "{}",
            file.display()
        );
    }
}

/// Of the animation at an instant: ends of neck and lip on the canvas, and the words that are seen.
const POSE: &str = "(share => {
    const svg = [...document.querySelectorAll('svg')].find(s => s.querySelector('animate')) ?? document.documentElement;
    const seconds = parseFloat(svg.querySelector('animate').getAttribute('dur'));
    svg.pauseAnimations();
    svg.setCurrentTime(share * seconds);
    const ends = path => [path.getPointAtLength(0), path.getPointAtLength(path.getTotalLength())].map(p => [p.x, p.y]);
    const links = [...svg.querySelectorAll('path:has(> animate)')].slice(0, 2).map(ends);
    const seen = g => getComputedStyle(g).opacity === '1';
    const words = [...svg.querySelectorAll('g:has(> animate) > text')].filter(t => seen(t.parentNode)).map(t => t.textContent);
    return {links, words};
})";

fn opened_animation(browser: &mut Browser, folder: &Path) {
    browser.resize(1000, 900);
    browser.open(&folder.join("animation.svg"));
    assert_eq!(complaints(browser), Vec::<String>::new());
}

#[test]
#[ignore = "needs Chromium: cargo test --test browser -- --ignored"]
fn the_links_of_the_animation_stay_joined_and_keep_their_lengths() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    opened_animation(&mut browser, &report(&project, TWIN));
    let mut first: Option<[f64; 2]> = None;
    let mut tips = Vec::new();
    for i in 0..60 {
        let pose = browser.evaluate(&format!("{POSE}({})", f64::from(i) / 60.0));
        let point = |link: usize, end: usize| [0, 1].map(|k| pose["links"][link][end][k].as_f64().unwrap());
        let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        assert!(apart(point(0, 1), point(1, 0)) < 1.0, "{i}: {pose}");
        let lengths = [0, 1].map(|link| apart(point(link, 0), point(link, 1)));
        let expected = *first.get_or_insert(lengths);
        // the ends are at most 0.3 canvas units from where they belong, and rounded to 0.1
        assert!(
            lengths.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1.5),
            "{i}: {lengths:?}, expected {expected:?}"
        );
        tips.push(point(1, 1)[0]);
    }
    assert!(tips[0] - tips[59] > 50.0, "the tip moves to the left after the release: {tips:?}");
}

#[test]
#[ignore = "needs Chromium: cargo test --test browser -- --ignored"]
fn the_animation_says_one_state_and_one_pace_at_a_time() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    opened_animation(&mut browser, &report(&project, TWIN));
    let mut said = std::collections::BTreeSet::new();
    for i in 0..200 {
        let pose = browser.evaluate(&format!("{POSE}({})", f64::from(i) / 200.0));
        let words: Vec<&str> = pose["words"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
        let of = |part: &str| words.iter().filter(|w| w.contains(part)).count();
        assert_eq!((words.len(), of("tip: "), of("times slower")), (2, 1, 1), "{i}: {words:?}");
        said.extend(words.into_iter().map(str::to_owned));
    }
    let expected = [
        "100 times slower",
        "500 times slower",
        "tip: slip+ (to the right)",
        "tip: slip\u{2212} (to the left)",
        "tip: stick",
    ];
    assert_eq!(said.iter().map(String::as_str).collect::<Vec<_>>(), expected);
}

#[test]
#[ignore = "needs Chromium: cargo test --test browser -- --ignored"]
fn a_reader_who_asked_for_less_motion_sees_the_poses_stand_still() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    let folder = report(&project, TWIN);
    for (motion, shown) in [("no-preference", true), ("reduce", false)] {
        browser.call(
            "Emulation.setEmulatedMedia",
            json!({"features": [{"name": "prefers-reduced-motion", "value": motion}]}),
        );
        opened_animation(&mut browser, &folder);
        let moves = browser.evaluate("document.querySelector('.moves').getBoundingClientRect().width > 0");
        assert_eq!(
            (moves, browser.evaluate("document.querySelectorAll('text').length > 8")),
            (json!(shown), json!(true)),
            "{motion}"
        );
    }
}
