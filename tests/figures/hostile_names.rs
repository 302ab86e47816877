//! Names from files try to be more than text, in reports of the built program; without a browser.

use crate::hostile;

use crate::files::files;
use crate::small_fit::Project;
use resvg::usvg;

/// A page and its figures hold no name as anything but text; gives the page.
fn page_of_text(project: &Project, folder: &str, least_figures: usize) -> String {
    let page = project.read(&format!("{folder}/index.html"));
    // (the last script is the page's own)
    let (page, _script) = page.rsplit_once("<script>").unwrap();
    for part in ["<script", "<img", "<b ", "<b>", "\u{7}", "\u{202e}"] {
        assert!(!page.contains(part), "{part:?}");
    }
    assert!(page.contains("&lt;script&gt;window.broken"));
    let figures =
        [files(&project.path(folder), "svg"), files(&project.path(folder).join("paper"), "svg")].concat();
    assert!(figures.len() >= least_figures, "{figures:?}");
    for file in figures {
        let name = file.file_name().and_then(|n| n.to_str()).unwrap();
        assert!(name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '.')), "{name}");
        let svg = std::fs::read_to_string(&file).unwrap();
        assert!(!svg.contains("<script") && !svg.contains("<img"), "{name}");
        usvg::Tree::from_str(&svg, &usvg::Options::default()).expect(name);
    }
    page.to_owned()
}

#[test]
fn names_stay_text_in_page_figures_and_file_names() {
    let project = hostile::project();
    let folder = format!("reports/{}", hostile::FIT);
    assert!(page_of_text(&project, &folder, 30).contains("onerror=alert(1)&gt;"));
    let json: serde_json::Value =
        serde_json::from_str(&project.read(&format!("{folder}/report.json"))).unwrap();
    let written = [
        &json["title"],
        &json["recordings"][0]["name"],
        &json["components"][0]["name"],
        &json["features"][0]["name"],
    ];
    assert_eq!(written.map(|name| name.as_str().unwrap()), hostile::NAMES);
}

#[test]
fn names_of_several_fits_are_isolated_text() {
    let (turned, tag) = ("\u{5e9}\u{5dc}\u{5d5}\u{5dd} \u{1f600}", "<b>'x'");
    let project = Project::of(hostile::RECORDING);
    let fits = [turned, tag].map(|name| {
        hostile::fit(&project, name);
        format!("fits/{name}")
    });
    let (code, _, stderr) = project.run(&["report", &fits[0], &fits[1], "--out", "both"]);
    assert_eq!(code, 0, "{stderr}");
    let page = page_of_text(&project, "both", 3);
    for shown in [turned, "&lt;b&gt;&#x27;x&#x27;"] {
        assert!(page.contains(&format!("<bdi>{shown}</bdi>")), "{shown}");
    }
}
