//! The formats that are read, and which of them a file is in. A new format is one file in this folder and its
//! line in [`FORMATS`].

mod animalta;
mod deeplabcut;
mod dice;
mod dippmotion;
mod dltdv;
mod fasttrack;
mod framedias;
mod generic;
mod idtracker;
mod imagej;
mod kinovea;
mod motion_analysis;
mod plain;
mod sleap;
mod tracker;
mod trackmate;
mod trackpy;
mod trc;
mod trex;
mod wiperlab;

use crate::import::error::ImportError;
use crate::import::format::Format;
use crate::import::options::Options;
use crate::import::reader::document::Document;
use crate::toml_file;

/// Formats that are read, in the order in which the content is asked.
static FORMATS: &[&dyn Format] = &[
    &wiperlab::Wiperlab,
    &dippmotion::DippMotion,
    &dice::Dice,
    &kinovea::Kinovea,
    &deeplabcut::DeepLabCut,
    &dltdv::Dltdv,
    &trackmate::TrackMate,
    &sleap::Sleap,
    &tracker::Tracker,
    &trc::Trc,
    &imagej::ImageJ,
    &fasttrack::FastTrack,
    &trackpy::Trackpy,
    &idtracker::IdTracker,
    &animalta::AnimalTa,
    &trex::Trex,
    &motion_analysis::MotionAnalysis,
    &framedias::FrameDias,
    &plain::Plain,
    &generic::Generic,
];

/// Programs whose layout is not published: their tables are read as plain ones.
const UNDOCUMENTED: [&str; 5] = ["movias", "movias-neo", "tema", "proanalyst", "xcitex"];

pub(crate) fn choose_format(
    documents: &[Document],
    options: &Options,
) -> Result<(&'static dyn Format, String), ImportError> {
    match options.format.as_deref() {
        None | Some("auto") => detect(documents, options),
        Some(name) => match FORMATS.iter().copied().find(|format| format.name() == name) {
            Some(format) => Ok((format, "as given with --format".to_owned())),
            None => Err(unknown_format(name)),
        },
    }
}

fn detect(documents: &[Document], options: &Options) -> Result<(&'static dyn Format, String), ImportError> {
    if options.columns.is_some() {
        // (these lose samples and are filtered, whoever names their columns)
        let format: &'static dyn Format =
            if documents.iter().all(kinovea::is_window) { &kinovea::Kinovea } else { &generic::Generic };
        return Ok((format, "--columns names the columns".to_owned()));
    }
    let recognised = |document: &Document| {
        FORMATS.iter().copied().find_map(|format| format.recognises(document).map(|reason| (format, reason)))
    };
    let mut found: Option<(&'static dyn Format, String)> = None;
    for document in documents {
        let Some((format, reason)) = recognised(document) else { return Err(unrecognised(document)) };
        match &found {
            Some((first, _)) if first.name() != format.name() => return Err(mixed(document, format, *first)),
            Some(_) => {}
            None => found = Some((format, reason)),
        }
    }
    found.ok_or(ImportError::NoSource)
}

fn mixed(document: &Document, found: &dyn Format, first: &dyn Format) -> ImportError {
    ImportError::format(
        document.file,
        format!("the format {}", found.name()),
        format!("{} as in the first file", first.name()),
        "export both tracks in one format, or name it with --format",
    )
}

/// The names of all formats, in the order of detection.
pub fn format_names() -> Vec<&'static str> {
    FORMATS.iter().map(|format| format.name()).collect()
}

fn unknown_format(name: &str) -> ImportError {
    let mut names = format_names();
    names.push("auto");
    let undocumented = UNDOCUMENTED.contains(&name.to_lowercase().replace([' ', '_'], "-").as_str());
    ImportError::format(
        "--format",
        format!("the format {name}"),
        format!("one of {}", names.join(", ")),
        if undocumented {
            "its layout is not published: export the points as text and say what its columns are, e.g. \
             --columns time=1,tip-x=2,tip-y=3,head-x=4,head-y=5"
                .to_owned()
        } else {
            format!("{}; any other table is read with --columns", toml_file::nearest(name, &names))
        },
    )
}

/// A file that no format recognises: its own problem, or a plain table whose columns have no names yet.
fn unrecognised(document: &Document) -> ImportError {
    document.table().map_or_else(|error| error, generic::unnamed)
}
