//! The marker of an output folder: the command that made each file, and the hash of the file's contents.

use crate::cli::failure::{Failure, Outcome};
use crate::text::TextHash;
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::Path;

/// Name of the marker in a folder.
pub(crate) const MARKER_FILE: &str = ".wiperlab.json";
const MARKER_FORMAT: u32 = 1;

/// The marker of a folder: the files that commands have made in the folder. It contains no timestamps, so
/// that the same outputs give the same marker.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FolderMarker {
    format: u32,
    /// Files by their name relative to the folder, with `/` as separator.
    pub files: BTreeMap<String, MarkedFile>,
}

/// A file that a command made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MarkedFile {
    pub by: OutputCommand,
    pub version: String,
    /// SHA-256 of the contents; CRLF counts as LF, and a byte-order mark is ignored.
    pub sha256: String,
    /// Hash of the previous file of this name, if the same command had made that file. The previous contents
    /// remain on the disk until all files are renamed, or if the program is killed before that; so the disk
    /// may contain either version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub replaces: Option<String>,
}

impl MarkedFile {
    pub(crate) fn matches_hash(&self, sha256: &str) -> bool {
        self.sha256 == sha256 || self.replaces.as_deref() == Some(sha256)
    }
}

impl Default for FolderMarker {
    fn default() -> Self {
        Self { format: MARKER_FORMAT, files: BTreeMap::new() }
    }
}

impl FolderMarker {
    /// Reads the marker of a folder. If there is none, returns an empty marker; if it cannot be read, returns
    /// an empty marker and the reason.
    pub(crate) fn load(folder: &Path) -> Outcome<(Self, Option<String>)> {
        let path = folder.join(MARKER_FILE);
        if !path.exists() {
            return Ok((Self::default(), None));
        }
        let bytes = read_small_file(&path);
        let parsed =
            bytes.and_then(|bytes| serde_json::from_slice::<Self>(&bytes).map_err(|e| e.to_string()));
        let known = parsed.and_then(|marker| match marker.format {
            MARKER_FORMAT => Ok(marker),
            other => Err(format!("found format {other}, expected {MARKER_FORMAT}")),
        });
        Ok(match known {
            Ok(marker) => (marker, None),
            Err(why) => (Self::default(), Some(format!("{} cannot be read: {why}", path.display()))),
        })
    }

    /// The command that made a file, if the file is unchanged.
    pub(crate) fn maker_if_unchanged(&self, name: &str, sha256: &str) -> Option<OutputCommand> {
        self.files.get(name).filter(|made| made.matches_hash(sha256)).map(|made| made.by)
    }
}

/// Size limit of a marker, description or summary, in bytes; the files of this program are smaller.
const MAX_MARKER_BYTES: u64 = 16_000_000;

/// Reads a marker, description or summary, if it is a file of at most [`MAX_MARKER_BYTES`].
pub(crate) fn read_small_file(path: &Path) -> Result<Vec<u8>, String> {
    let found = fs::metadata(path).map_err(|error| error.to_string())?;
    if !found.is_file() || found.len() > MAX_MARKER_BYTES {
        return Err(format!("expected a file of at most {MAX_MARKER_BYTES} bytes"));
    }
    fs::read(path).map_err(|error| error.to_string())
}

/// Hash of a file, computed as for a marker; `None` if the file does not exist.
pub(crate) fn hash_file(path: &Path) -> Outcome<Option<String>> {
    let refused = |error: io::Error| Failure::at(path.display(), format!("cannot be read: {error}"));
    if !path.is_file() {
        return Ok(None);
    }
    let mut hashing = HashingReader::new(File::open(path).map_err(refused)?);
    io::copy(&mut hashing, &mut io::sink()).map_err(refused)?;
    Ok(Some(hashing.hash.finish()))
}

/// A reader that computes the hash of everything that is read through it.
pub(crate) struct HashingReader<R> {
    from: R,
    pub hash: TextHash,
}

impl<R: Read> HashingReader<R> {
    pub(crate) fn new(from: R) -> Self {
        Self { from, hash: TextHash::default() }
    }
}

impl<R: Read> Read for HashingReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.from.read(buffer)?;
        self.hash.update(&buffer[..read]);
        Ok(read)
    }
}

/// A command that writes files into a folder, as recorded in the marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum OutputCommand {
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
    Stability,
    Submit,
    Sweep,
    Twin,
}

impl OutputCommand {
    /// Name of the command on the command line and in the marker.
    pub(crate) fn command_name(self) -> String {
        format!("{self:?}").to_lowercase()
    }

    /// Whether the command makes a recording; a folder contains at most one.
    pub(crate) fn makes_recordings(self) -> bool {
        matches!(self, Self::Import | Self::Simulate | Self::Twin)
    }

    /// Whether the command removes those files of its previous run that it does not write again. An import
    /// does not, since it keeps exports. Neither do init, demo and figures, which write next to files of
    /// other commands.
    pub(crate) fn replaces_last_run(self) -> bool {
        !matches!(self, Self::Demo | Self::Figures | Self::Import | Self::Init)
    }

    /// Advice to a user whose command would overwrite a file that it did not make.
    pub(crate) fn overwrite_advice(self) -> &'static str {
        match self {
            Self::Fit => "move the file away",
            Self::Figures => "choose another folder, move the file away",
            _ => "choose another --out, move the file away",
        }
    }
}

/// The option `--force` of every command that writes into a folder.
#[derive(Debug, Clone, Copy, Default, Args)]
pub(crate) struct Overwrite {
    /// Overwrite even files that this command did not make, or that were changed since it made them; never a
    /// measured recording
    #[arg(long)]
    pub force: bool,
}

/// The command that writes files, what it may overwrite, and the dialect of its tables.
#[derive(Debug, Clone)]
pub(crate) struct WritePolicy {
    pub maker: OutputCommand,
    pub force: bool,
    /// SHA-256 of the exports that an import reads; an import of the same exports may replace a measured
    /// recording.
    pub exports: Vec<String>,
    /// Dialect of the tables; a trace is always plain, since programs read it.
    pub csv: CsvDialect,
}

impl WritePolicy {
    pub(crate) fn new(maker: OutputCommand, overwrite: Overwrite) -> Self {
        Self { maker, force: overwrite.force, exports: Vec::new(), csv: CsvDialect::Plain }
    }
}

/// Dialect of tables, for users who open them with a double click.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(crate) enum CsvDialect {
    /// Commas between cells, decimal points (RFC 4180 with line feeds): readable by every program
    #[default]
    Plain,
    /// Excel with a decimal comma, as in Germany: semicolons between cells, decimal commas
    ExcelDe,
    /// Excel with a decimal point, as in the US
    ExcelUs,
}

/// Byte-order mark, which tells Excel that a file is UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

impl CsvDialect {
    /// Converts a plain table to this dialect. Numeric cells get the decimal mark of the dialect; all other
    /// cells are unchanged.
    pub(crate) fn convert_table(self, plain: impl Read, mut to: impl Write) -> io::Result<()> {
        to.write_all(BYTE_ORDER_MARK)?;
        let decimal_comma = self == Self::ExcelDe;
        let mut table = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(plain);
        let mut writer = csv::WriterBuilder::new();
        writer.delimiter(if decimal_comma { b';' } else { b',' }).flexible(true);
        let mut writer = writer.terminator(csv::Terminator::CRLF).from_writer(to);
        for row in table.records() {
            let row = row?;
            let cells = row.iter().map(|cell| {
                let decimal = decimal_comma && cell.contains('.') && cell.parse::<f64>().is_ok();
                if decimal { cell.replace('.', ",") } else { cell.to_owned() }
            });
            writer.write_record(cells)?;
        }
        writer.flush()
    }
}
