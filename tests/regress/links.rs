//! Every link, image and anchor of a page leads somewhere: in the repository, and in the site that
//! `.ci/site` builds.

use crate::tracked::{root, tracked};
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Where links of a page lead, and where links to its parts may lead.
#[derive(Default)]
struct Page {
    targets: Vec<String>,
    anchors: BTreeSet<String>,
}

impl Page {
    fn of_markdown(text: &str) -> Self {
        let mut page = Self::default();
        let mut html = String::new();
        let mut heading = None;
        for event in Parser::new_ext(text, Options::ENABLE_TABLES | Options::ENABLE_FOOTNOTES) {
            match event {
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                    page.targets.push(dest_url.into_string());
                }
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => page.add_heading(&heading.take().unwrap()),
                Event::Text(part) | Event::Code(part) => {
                    if let Some(heading) = &mut heading {
                        heading.push_str(&part);
                    }
                }
                Event::Html(part) | Event::InlineHtml(part) => html.push_str(&part),
                _ => {}
            }
        }
        page.add_html(&html);
        page
    }

    fn of_html(text: &str) -> Self {
        let mut page = Self::default();
        page.add_html(text);
        page
    }

    /// The anchor that a heading gets on the sites of repositories, and in mdBook.
    fn add_heading(&mut self, heading: &str) {
        let kept = heading.trim().to_lowercase();
        let kept = kept.chars().filter(|c| c.is_alphanumeric() || "-_ ".contains(*c));
        let anchor: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
        let numbered = (1..).map(|n| format!("{anchor}-{n}"));
        let free = std::iter::once(anchor.clone()).chain(numbered).find(|name| !self.anchors.contains(name));
        self.anchors.extend(free);
    }

    /// Links and names of elements, whose values stand in double quotes.
    fn add_html(&mut self, text: &str) {
        // (what a script holds is no element)
        let without_scripts = text.split("<script").enumerate().map(|(i, part)| {
            let end = if i == 0 { Some(part) } else { part.split_once("</script>").map(|(_, rest)| rest) };
            end.unwrap_or("")
        });
        for part in without_scripts {
            let tags = part.split('<').skip(1).filter_map(|rest| rest.split('>').next());
            for tag in tags {
                let values = |name: &str| {
                    let start = format!(" {name}=\"");
                    let value = tag.replace('\n', " ").split_once(&start)?.1.split('"').next()?.to_owned();
                    Some(html_escape::decode_html_entities(&value).into_owned())
                };
                self.targets.extend(["href", "src"].into_iter().filter_map(values));
                self.anchors.extend(values("id"));
            }
        }
    }
}

/// The path that a link from a file leads to, and the part of it; `None` where it leaves the repository.
fn resolve(from: &str, target: &str) -> Option<(String, Option<String>)> {
    let is_elsewhere = ["https:", "http:", "data:", "mailto:"].iter().any(|start| target.starts_with(start));
    if is_elsewhere {
        return None;
    }
    let (path, anchor) =
        target.split_once('#').map_or((target, None), |(path, anchor)| (path, Some(anchor.to_owned())));
    if path.is_empty() {
        return Some((from.to_owned(), anchor));
    }
    let mut folders: Vec<&str> = from.split('/').collect();
    folders.pop();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." if folders.pop().is_none() => return Some((target.to_owned(), anchor)),
            ".." => {}
            name => folders.push(name),
        }
    }
    Some((folders.join("/"), anchor))
}

/// Links of the pages that lead nowhere.
fn broken(files: &BTreeSet<String>, pages: &BTreeMap<String, Page>) -> Vec<String> {
    let is_folder =
        |path: &str| path.is_empty() || files.iter().any(|file| file.starts_with(&format!("{path}/")));
    let mut broken = Vec::new();
    for (from, page) in pages {
        for target in &page.targets {
            let Some((path, anchor)) = resolve(from, target) else { continue };
            let has_anchor = |anchor| pages.get(&path).is_some_and(|page| page.anchors.contains(anchor));
            if !files.contains(&path) && !is_folder(&path) {
                broken.push(format!("{from}: {target}: no file {path}"));
            } else if anchor.as_ref().is_some_and(|anchor| !has_anchor(anchor)) {
                broken.push(format!("{from}: {target}: no such part of {path}"));
            }
        }
    }
    broken
}

#[test]
fn links_of_tracked_pages_lead_to_tracked_files_and_their_parts() {
    let Some(files) = tracked() else { return };
    let read = |path: &String| {
        let text = || fs::read_to_string(root().join(path)).unwrap();
        let page = match Path::new(path).extension()?.to_str()? {
            "md" => Page::of_markdown(&text()),
            "html" => Page::of_html(&text()),
            _ => return None,
        };
        Some((path.clone(), page))
    };
    let pages: BTreeMap<String, Page> = files.iter().filter_map(read).collect();
    let links: usize = pages.values().map(|page| page.targets.len()).sum();
    assert!(pages.len() > 50 && links > 200, "{} pages with {links} links", pages.len());
    let broken = broken(&files.into_iter().collect(), &pages);
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn the_contents_of_the_site_are_all_pages_of_docs_and_exist() {
    let Some(files) = tracked() else { return };
    let summary = Page::of_markdown(&fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap()).targets;
    let listed: BTreeSet<String> =
        summary.iter().map(|target| resolve("docs/SUMMARY.md", target).unwrap().0).collect();
    assert_eq!(listed.len(), summary.len(), "a page is listed twice");
    let is_page = |path: &&String| path.starts_with("docs/") && path.ends_with(".md");
    let unlisted: Vec<_> = files
        .iter()
        .filter(is_page)
        .filter(|path| *path != "docs/SUMMARY.md" && !listed.contains(*path))
        .collect();
    assert!(unlisted.is_empty(), "docs/SUMMARY.md: {unlisted:?} are not listed");
}

#[test]
#[ignore = "needs the site that .ci/site builds"]
fn links_of_the_built_site_lead_to_its_files_and_their_parts() {
    let site = root().join("target/site");
    let mut files = BTreeSet::new();
    let mut open = vec![site.clone()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                open.push(entry);
            } else {
                files.insert(name(&site, &entry));
            }
        }
    }
    // (the page of a missing address stands for any folder)
    let is_page = |file: &&String| file.ends_with(".html") && *file != "404.html";
    let read = |file: &String| (file.clone(), Page::of_html(&fs::read_to_string(site.join(file)).unwrap()));
    let pages: BTreeMap<String, Page> = files.iter().filter(is_page).map(read).collect();
    assert!(pages.len() > 20, "{:?}", pages.keys());
    let broken = broken(&files, &pages);
    assert!(broken.is_empty(), "{broken:#?}");
}

fn name(site: &Path, file: &Path) -> String {
    file.strip_prefix(site).unwrap().to_str().unwrap().replace('\\', "/")
}

#[test]
fn what_leads_nowhere_is_found() {
    let text =
        "# A `b` (c)\n\n## Same\n\n## Same\n\n[x](#a-b-c) [x](#same-1) [x](#same-2) ![x](no.svg) [x](../y.md)
<a href=\"z.md\"><img src=\"&#x2F;no\"></a> `[x](code.md)` [x](https://a.b) [y.md](docs/y.md#there)";
    let page = |text: &str| Page::of_markdown(text);
    let pages = BTreeMap::from([
        ("docs/x.md".to_owned(), page(text)),
        ("docs/docs/y.md".to_owned(), page("# There")),
    ]);
    let files = pages.keys().cloned().chain(["y.md".to_owned()]).collect();
    let found = broken(&files, &pages);
    let expected = [
        "docs/x.md: #same-2: no such part of docs/x.md",
        "docs/x.md: no.svg: no file docs/no.svg",
        "docs/x.md: z.md: no file docs/z.md",
        "docs/x.md: /no: no file docs/no",
    ];
    assert_eq!(found, expected);
}
