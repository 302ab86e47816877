//! Who writes an output folder.

use super::dialect::CsvDialect;
use clap::Args;
use serde::{Deserialize, Serialize};

/// A command that writes files into a folder; the word that the marker keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutputCommand {
    Accuracy,
    Blade,
    Demo,
    Figures,
    Fit,
    Import,
    Init,
    Man,
    Report,
    Simulate,
    Spectrum,
    Submit,
    Sweep,
    Twin,
}

impl OutputCommand {
    /// The command's name.
    pub fn command_name(self) -> &'static str {
        match self {
            Self::Accuracy => "accuracy",
            Self::Blade => "blade",
            Self::Demo => "demo",
            Self::Figures => "figures",
            Self::Fit => "fit",
            Self::Import => "import",
            Self::Init => "init",
            Self::Man => "man",
            Self::Report => "report",
            Self::Simulate => "simulate",
            Self::Spectrum => "spectrum",
            Self::Submit => "submit",
            Self::Sweep => "sweep",
            Self::Twin => "twin",
        }
    }

    /// Whether what it makes is a recording, of which a folder holds one.
    pub fn makes_recordings(self) -> bool {
        matches!(self, Self::Import | Self::Simulate | Self::Twin)
    }

    /// Whether all its files in a folder are of one run: those of an earlier run that the next one does not
    /// make are then removed. An import keeps exports, and init, demo and figures write next
    /// to files of others.
    pub fn replaces_last_run(self) -> bool {
        !matches!(self, Self::Demo | Self::Figures | Self::Import | Self::Init)
    }

    /// What to do instead of overwriting a file.
    pub fn overwrite_advice(self) -> &'static str {
        match self {
            Self::Fit => "move the file away",
            Self::Figures => "choose another folder, move the file away",
            _ => "choose another --out, move the file away",
        }
    }
}

/// The option of every command that writes into a folder.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct Overwrite {
    /// Overwrite also files that this command did not make, or that were changed since it made them; never a
    /// measured recording
    #[arg(long)]
    pub force: bool,
}

/// Who writes, and what it may overwrite.
#[derive(Debug, Clone)]
pub struct WritePolicy {
    pub maker: OutputCommand,
    pub force: bool,
    /// SHA-256 of the exports that an import reads; a measured recording gives way to an import of the same
    /// ones.
    pub exports: Vec<String>,
    /// How its tables are written; a trace is always plain, as programs read it.
    pub csv: CsvDialect,
}

impl WritePolicy {
    pub fn new(maker: OutputCommand, overwrite: Overwrite) -> Self {
        Self { maker, force: overwrite.force, exports: Vec::new(), csv: CsvDialect::Plain }
    }

    /// The same with tables in a dialect.
    pub fn with_csv_dialect(self, csv: CsvDialect) -> Self {
        Self { csv, ..self }
    }
}
