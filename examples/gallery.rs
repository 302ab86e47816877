//! Writes docs/gallery.md and the gallery of README.md from the figures in the repository: `cargo run
//! --release --example gallery`.
//!
//! The figures themselves are made by the commands that the gallery names, from committed fits, studies and
//! scenes. This program draws nothing: it lists them with what they say of themselves.

use std::fs;
use std::path::{Path, PathBuf};

/// A folder of figures and the command that makes it.
struct Sheet {
    heading: &'static str,
    folder: &'static str,
    command: &'static str,
}

const SHEETS: [Sheet; 7] = [
    Sheet {
        heading: "A fit to a synthetic recording",
        folder: "reports/actual-blade-twin",
        command: "wiperlab report fits/actual-blade-twin",
    },
    Sheet {
        heading: "A fit to published frequencies",
        folder: "reports/published-experiment",
        command: "wiperlab report fits/published-experiment",
    },
    Sheet {
        heading: "Speed against error",
        folder: "data/work-precision/light-blade",
        command: "wiperlab accuracy data/scenes/light-blade.toml --out data/work-precision/light-blade",
    },
    Sheet {
        heading: "Friction A and C",
        folder: "data/sweeps/friction",
        command: "wiperlab sweep data/sweeps/friction.toml --out data/sweeps/friction",
    },
    Sheet {
        heading: "Speed and preload",
        folder: "data/sweeps/speed-preload",
        command: "wiperlab sweep data/sweeps/speed-preload.toml --out data/sweeps/speed-preload",
    },
    Sheet {
        heading: "One parameter",
        folder: "data/sweeps/neck",
        command: "wiperlab sweep data/sweeps/neck.toml --out data/sweeps/neck",
    },
    Sheet {
        heading: "Two fits side by side",
        folder: "reports/published-simulation-and-published-experiment",
        command: "wiperlab report fits/published-simulation fits/published-experiment",
    },
];

/// Figures that the README shows, two in a row.
const FEATURED: [&str; 2] =
    ["reports/actual-blade-twin/animation.svg", "reports/actual-blade-twin/cycle.svg"];

/// What stands round the gallery in the README.
const MARKS: [&str; 2] =
    ["<!-- gallery: cargo run --release --example gallery -->\n", "<!-- end of the gallery -->\n"];

/// The two pages, by name.
///
/// # Errors
/// What could not be read, in words.
pub fn pages(root: &Path) -> Result<[(PathBuf, String); 2], String> {
    let sheets = SHEETS.iter().map(|sheet| section(root, sheet)).collect::<Result<String, String>>()?;
    let gallery = format!(
        "# Gallery\n\nEvery figure that wiperlab draws, from data in this repository. All recordings are synthetic \
         and say so; other numbers are published or simulated. For print, `paper/` next to each file holds the \
         same figure at 85 mm and 170 mm width. `cargo run --release --example gallery` writes this page.\n\
         {sheets}"
    );
    let readme = root.join("README.md");
    Ok([(root.join("docs/gallery.md"), gallery), (readme.clone(), featured(root, &read(&readme)?)?)])
}

fn section(root: &Path, sheet: &Sheet) -> Result<String, String> {
    let figures: String = figures(&root.join(sheet.folder))?
        .into_iter()
        .map(|(file, caption)| shown(sheet.folder, &file, &caption))
        .collect();
    Ok(format!("\n## {}\n\n```sh\n{}\n```\n{figures}", sheet.heading, sheet.command))
}

fn shown(folder: &str, file: &str, caption: &str) -> String {
    format!("\n![{}](../{folder}/{file})\n\n{caption}\n", file.trim_end_matches(".svg"))
}

/// Files with their captions: in the order of the report where there is one, otherwise by name with the
/// figure's own description.
fn figures(folder: &Path) -> Result<Vec<(String, String)>, String> {
    let report = folder.join("report.json");
    if report.is_file() {
        let report: serde_json::Value = serde_json::from_str(&read(&report)?)
            .map_err(|problem| format!("{}: {problem}", report.display()))?;
        let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
        let listed = report["figures"].as_array().cloned().unwrap_or_default();
        return Ok(listed.iter().map(|figure| (text(&figure["file"]), text(&figure["caption"]))).collect());
    }
    let entries = fs::read_dir(folder).map_err(|problem| format!("{}: {problem}", folder.display()))?;
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.ends_with(".svg"))
        .collect();
    names.sort_unstable();
    names.into_iter().map(|name| Ok((name.clone(), described(&read(&folder.join(name))?)))).collect()
}

/// What a figure says of itself.
fn described(svg: &str) -> String {
    format!("{}: {}", within(svg, "aria-label=\"", "\""), within(svg, "<desc>", "</desc>"))
}

fn within<'a>(svg: &'a str, from: &str, to: &str) -> &'a str {
    svg.split_once(from).and_then(|(_, rest)| rest.split_once(to)).map_or("", |(text, _)| text)
}

/// The README with its gallery made again.
fn featured(root: &Path, readme: &str) -> Result<String, String> {
    let parts =
        readme.split_once(MARKS[0]).and_then(|(before, rest)| Some((before, rest.split_once(MARKS[1])?.1)));
    let (before, after) = parts.ok_or("README.md: the marks round its gallery are missing")?;
    let cell = |path: &&str| {
        let svg = read(&root.join(path))?;
        let title = within(&svg, "aria-label=\"", "\"");
        Ok(format!(
            "<td width=\"50%\"><a href=\"{path}\"><img src=\"{path}\" alt=\"{title}\" \
             width=\"100%\"></a></td>"
        ))
    };
    let cells = FEATURED.iter().map(cell).collect::<Result<Vec<String>, String>>()?;
    let rows: String = cells.chunks(2).map(|row| format!("<tr>{}</tr>\n", row.concat())).collect();
    Ok(format!("{before}{}<table>\n{rows}</table>\n{}{after}", MARKS[0], MARKS[1]))
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|problem| format!("{}: {problem}", path.display()))
}

#[allow(dead_code, reason = "the test that holds the pages against the figures includes this file")]
fn main() -> Result<(), String> {
    for (path, text) in pages(Path::new(env!("CARGO_MANIFEST_DIR")))? {
        fs::write(&path, text).map_err(|problem| format!("{}: {problem}", path.display()))?;
        println!("{}", path.display());
    }
    Ok(())
}
