//! Names from files try to be more than text, in a report of the built program; without a browser.

#[path = "common/hostile.rs"]
mod hostile;
#[path = "common/project.rs"]
mod project;

use project::files;
use resvg::usvg;

#[test]
fn names_stay_text_in_page_figures_and_file_names() {
    let project = hostile::project();
    let folder = project.path("reports").join(hostile::FIT);
    let page = std::fs::read_to_string(folder.join("index.html")).unwrap();
    for part in ["<script", "<img", "<b ", "\u{7}"] {
        assert!(!page.contains(part), "{part:?}");
    }
    assert!(page.contains("&lt;script&gt;window.broken") && page.contains("onerror=alert(1)&gt;"));
    let figures = [files(&folder, "svg"), files(&folder.join("paper"), "svg")].concat();
    assert!(figures.len() >= 4, "{figures:?}");
    for file in figures {
        let name = file.file_name().and_then(|n| n.to_str()).unwrap();
        assert!(name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '.')), "{name}");
        let svg = std::fs::read_to_string(&file).unwrap();
        assert!(!svg.contains("<script") && !svg.contains("<img"), "{name}");
        usvg::Tree::from_str(&svg, &usvg::Options::default()).expect(name);
    }
    let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(folder.join("report.json")).unwrap()).unwrap();
    let written = [&json["title"], &json["recordings"][0]["name"], &json["components"][0]["name"], &json["features"][0]["name"]];
    assert_eq!(written.map(|name| name.as_str().unwrap()), hostile::NAMES);
}
