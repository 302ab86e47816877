//! The page and the figures in a browser: nothing is asked of the network, nothing is cut off, dark and
//! light, on screen and on paper.
//!
//! These tests need Chromium, named by the variable CHROMIUM or found on PATH: `cargo test --test figures
//! browser:: -- --ignored`.

use crate::driver::Browser;
use crate::files::files;
use crate::hostile;
use crate::project::Project;
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
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
fn a_page_asks_for_nothing_and_complains_of_nothing() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    for fit in [TWIN, PUBLISHED] {
        browser.open(&report(&project, fit).join("index.html"));
        assert_eq!(complaints(&browser), Vec::<String>::new(), "{fit}");
        assert_eq!(requests(&browser).len(), 1, "{fit}: {:?}", requests(&browser));
        assert_eq!(
            browser.evaluate(
                "document.querySelectorAll('link, iframe, object, embed, img, script[src]').length"
            ),
            0,
            "{fit}"
        );
        assert_eq!(browser.evaluate("document.querySelectorAll('script').length"), 1, "{fit}: its own");
        assert!(
            browser.evaluate("document.querySelectorAll('figure svg').length").as_u64().unwrap() >= 3,
            "{fit}"
        );
    }
}

/// Unfolds everything of a page.
const UNFOLD: &str = "document.querySelectorAll('details').forEach(d => { d.open = true; })";

/// What is wider than its place, as a list of names: the page, tables, commands, figures.
const TOO_WIDE: &str = "[...document.querySelectorAll('html, main, .scroll, pre, figure, table, dl')]
    .filter(e => e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).display !== 'inline')
    .map(e => `${e.tagName}.${e.className}: ${e.scrollWidth} of ${e.clientWidth}`)";

#[test]
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
fn nothing_scrolls_sideways_on_a_telephone_a_tablet_and_a_wide_screen() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    for fit in [TWIN, PUBLISHED] {
        let page = report(&project, fit).join("index.html");
        for width in [400, 800, 1600] {
            browser.resize(width, 900);
            browser.open(&page);
            browser.evaluate(UNFOLD);
            assert_eq!(browser.evaluate("document.documentElement.clientWidth"), width);
            let content = browser.evaluate("document.documentElement.scrollWidth").as_u64().unwrap();
            assert!(content <= u64::from(width), "{fit}, {width}: {content} wide");
            if width == 400 {
                assert_eq!(browser.evaluate(TOO_WIDE), json!([]), "{fit}");
                // font sizes in figures and in the text around them, CSS pixels
                let figures = browser.evaluate(
                    "Math.min(...[...document.querySelectorAll('figure svg text')] \
                     .map(t => t.getAttribute('font-size') * t.ownerSVGElement.getScreenCTM().a))",
                );
                let words = browser.evaluate(
                    "Math.min(...[...document.querySelectorAll('main *:not(svg *)')] \
                     .map(e => parseFloat(getComputedStyle(e).fontSize)))",
                );
                assert!(figures.as_f64().unwrap() >= 12.0, "{fit}: {figures}");
                assert!(words.as_f64().unwrap() >= 12.0, "{fit}: {words}");
            }
        }
    }
}

#[test]
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
fn the_first_screen_holds_the_answer() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    for fit in [TWIN, PUBLISHED] {
        browser.resize(1280, 900);
        browser.open(&report(&project, fit).join("index.html"));
        for part in [".headline", "#answer table", "#answer p:has(strong)"] {
            let foot =
                browser.evaluate(&format!("document.querySelector('{part}').getBoundingClientRect().bottom"));
            assert!(foot.as_f64().unwrap() < 900.0, "{fit}, {part}: {foot}");
        }
        // (all that is not asked for is folded away)
        let height = browser.evaluate("document.documentElement.scrollHeight").as_u64().unwrap();
        browser.evaluate(UNFOLD);
        let unfolded = browser.evaluate("document.documentElement.scrollHeight").as_u64().unwrap();
        assert!(2 * height < unfolded && height < 8000, "{fit}: {height} px of {unfolded} px");
    }
}

/// A place in the first plot of the page in CSS pixels of the window, as shares of its width and height.
fn in_plot(browser: &mut Browser, x: f64, y: f64) -> (f64, f64) {
    let found = browser.evaluate(&format!(
        "(() => {{
            const plot = document.querySelector('g.plot'), [l, t, r, b] = plot.dataset.area.split(' ').map(Number);
            plot.ownerSVGElement.scrollIntoView();
            const p = new DOMPoint(l + (r - l) * {x}, b - (b - t) * {y}).matrixTransform(plot.ownerSVGElement.getScreenCTM());
            return [p.x, p.y];
        }})()"
    ));
    (found[0].as_f64().unwrap(), found[1].as_f64().unwrap())
}

fn mouse(browser: &mut Browser, kind: &str, (x, y): (f64, f64), pressed: bool) {
    let button = if pressed { "left" } else { "none" };
    let buttons = u8::from(pressed && kind != "mouseReleased");
    browser.call(
        "Input.dispatchMouseEvent",
        json!({"type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": 1}),
    );
}

fn press(browser: &mut Browser, key: &str, code: u32) {
    for kind in ["keyDown", "keyUp"] {
        browser.call(
            "Input.dispatchKeyEvent",
            json!({"type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code}),
        );
    }
}

/// What the bar at the foot of the page says.
fn said(browser: &mut Browser) -> String {
    browser.evaluate("document.querySelector('.reader output').textContent").as_str().unwrap().to_owned()
}

/// Edges of the first plot of the page, s.
fn shown_s(browser: &mut Browser) -> Vec<f64> {
    let ticks = browser.evaluate("document.querySelector('g.plot .ticks:has(text)').textContent");
    ticks.as_str().unwrap().split_whitespace().filter_map(|t| t.parse().ok()).collect()
}

#[test]
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
fn the_pointer_reads_values_and_a_drag_enlarges() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    browser.resize(1000, 1200);
    browser.open(&report(&project, TWIN).join("index.html"));
    let all = shown_s(&mut browser);
    let before = browser.evaluate("document.querySelector('g.plot').innerHTML");
    let at = in_plot(&mut browser, 0.4, 0.5);
    mouse(&mut browser, "mouseMoved", at, false);
    // every frame of the model, decoded here, against what the page reads under the pointer
    let expected = browser.evaluate(
        "(() => {
            const plot = document.querySelector('g.plot'), series = plot.querySelector('.series');
            const [start, step, digits] = series.dataset.grid.split(' ').map(Number);
            const [from, to] = plot.dataset.x.split(' ').map(Number);
            const time = from + 0.4 * (to - from), frame = Math.round((time - start) / step);
            const sum = series.dataset.values.split(' ').slice(0, frame + 1).reduce((s, v) => v === '-' ? s : s + Number(v), 0);
            return [start + step * frame, sum / 10 ** digits];
        })()",
    );
    let words = said(&mut browser);
    let read: Vec<f64> = words
        .split(|c: char| !(c.is_ascii_digit() || c == '.'))
        .filter_map(|number| number.parse().ok())
        .collect();
    let close = |found: f64, expected: &Value, within: f64| {
        assert!((found - expected.as_f64().unwrap().abs()).abs() < within, "{words}: {expected}");
    };
    close(read[0], &expected[0], 1e-4);
    close(read[1], &expected[1], 1e-4);
    assert!(words.contains("deflection, mm: model ") && words.contains("residual / noise: "), "{words}");
    let cursors = browser.evaluate("document.querySelectorAll('.cursor[visibility=visible]').length");
    assert!(cursors.as_u64().unwrap() > 3, "one cursor over many plots: {cursors}");

    let (from, to) = (in_plot(&mut browser, 0.5, 0.5), in_plot(&mut browser, 0.6, 0.5));
    mouse(&mut browser, "mousePressed", from, true);
    mouse(&mut browser, "mouseMoved", to, true);
    mouse(&mut browser, "mouseReleased", to, true);
    let part = shown_s(&mut browser);
    let span = |list: &[f64]| list[list.len() - 1] - list[0];
    assert!(part.len() > 2 && span(&part) < 0.2 * span(&all), "{part:?} of {all:?}");
    assert_eq!(browser.evaluate("document.querySelectorAll('.within[clip-path]').length > 8"), true);
    // all frames of the part: 5,000 a second
    let corners = browser
        .evaluate("document.querySelector('g.plot .series path').getAttribute('d').match(/[ML]/g).length");
    assert!(corners.as_u64().unwrap() > 250, "{corners}");
    press(&mut browser, "Escape", 27);
    assert_eq!(shown_s(&mut browser), all);
    let drawn = |html: &Value| html.as_str().unwrap().matches("<text").count();
    let after = browser.evaluate("document.querySelector('g.plot').innerHTML");
    assert_eq!(drawn(&before), drawn(&after));
    assert_eq!(complaints(&browser), Vec::<String>::new());
}

#[test]
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
fn keys_alone_reach_the_contents_the_cursor_and_the_animation() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    browser.resize(1000, 900);
    browser.open(&report(&project, TWIN).join("index.html"));
    press(&mut browser, "Tab", 9);
    assert_eq!(browser.evaluate("document.activeElement.className"), "skip");
    browser.evaluate("document.querySelector('.reader input').focus()");
    let said_before = said(&mut browser);
    for _ in 0..3 {
        press(&mut browser, "ArrowRight", 39);
    }
    assert_ne!(said(&mut browser), said_before);
    assert!(said(&mut browser).contains("deflection, mm"), "{}", said(&mut browser));
    browser.evaluate("document.querySelector('.reader button').focus()");
    let all = shown_s(&mut browser);
    press(&mut browser, " ", 32);
    assert_ne!(shown_s(&mut browser), all, "enlarged by a key");
    // every control says what it is for
    let nameless = browser.evaluate(
        "[...document.querySelectorAll('button, input')].filter(e => !e.getAttribute('aria-label') && !e.textContent).length",
    );
    assert_eq!(nameless, 0);

    browser.evaluate(UNFOLD);
    let time = "document.querySelector('svg:has(.moves)').getCurrentTime()";
    browser.evaluate("document.querySelector('.player input').focus()");
    for _ in 0..20 {
        press(&mut browser, "ArrowRight", 39);
    }
    let moved = browser.evaluate(time).as_f64().unwrap();
    assert!(moved > 0.05, "the slider moves it: {moved} s");
    let wait = "new Promise(done => setTimeout(done, 400))";
    browser.evaluate(wait);
    assert_eq!(browser.evaluate(time), moved, "it stands");
    browser.evaluate("document.querySelector('.player button').click()");
    browser.evaluate(wait);
    let later = browser.evaluate(time).as_f64().unwrap();
    assert!(later > moved + 0.1, "it runs: {moved} s, {later} s");
    browser.evaluate("document.querySelector('.player button').click()");
    let stopped = browser.evaluate(time);
    browser.evaluate(wait);
    assert_eq!(browser.evaluate(time), stopped);
    assert_eq!(complaints(&browser), Vec::<String>::new());
}

#[test]
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
fn a_page_without_its_script_is_complete() {
    let (project, mut browser) = (Project::copied(), Browser::start());
    let page = report(&project, TWIN).join("index.html");
    browser.open(&page);
    let count = |browser: &mut Browser| {
        browser.evaluate(
            "['figure', 'table', 'h2', 'details', 'nav a'].map(s => document.querySelectorAll(s).length)",
        )
    };
    let with_script = count(&mut browser);
    let text = std::fs::read_to_string(&page).unwrap();
    let (before, rest) = text.rsplit_once("<script>").unwrap();
    std::fs::write(&page, [before, rest.split_once("</script>").unwrap().1].concat()).unwrap();
    browser.open(&page);
    assert_eq!(browser.evaluate("document.querySelectorAll('script').length"), 0);
    assert_eq!(count(&mut browser), with_script);
    assert_eq!(browser.evaluate("document.querySelectorAll('.reader, .player').length"), 0);
    // a link to what is folded unfolds it
    browser.evaluate("location.hash = '#parameters'");
    assert_eq!(browser.evaluate("document.querySelector('#parameters').closest('details').open"), true);
}

#[test]
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
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
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
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
        browser.evaluate(UNFOLD);
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
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
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
        browser.evaluate(UNFOLD);
        assert_eq!(browser.evaluate(TEXTS_OUTSIDE), json!([]), "{fit}");
    }
}

#[test]
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
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
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
fn hostile_names_are_shown_as_text() {
    let (project, mut browser) = (hostile::project(), Browser::start());
    browser.open(&project.path("reports").join(hostile::FIT).join("index.html"));
    assert_eq!(complaints(&browser), Vec::<String>::new());
    assert_eq!(requests(&browser).len(), 1, "{:?}", requests(&browser));
    assert_eq!(
        browser.evaluate("document.querySelectorAll('[onload], [onerror], [onclick], body b').length"),
        0
    );
    assert_eq!(browser.evaluate("document.querySelectorAll('script').length"), 1, "the page's own");
    assert_eq!(browser.evaluate("typeof window.broken"), "undefined");
    let text = browser.evaluate("document.body.textContent");
    for name in hostile::NAMES {
        // what would turn the direction of the text after it is left out
        let shown = name.replace('\u{202e}', "");
        assert!(text.as_str().unwrap().contains(&shown), "{shown:?}");
    }
    assert_eq!(browser.evaluate("document.title"), hostile::TITLE);
    browser.evaluate(UNFOLD);
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
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
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
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
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
#[ignore = "needs Chromium: cargo test --test figures browser:: -- --ignored"]
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
