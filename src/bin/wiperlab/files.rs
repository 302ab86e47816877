//! Reading and writing: outputs of a command appear all together or not at all.

use crate::failure::Failure;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Bytes of a file that the user named.
pub fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    fs::read(path).map_err(|error| {
        let advice = match error.kind() {
            ErrorKind::NotFound => "no such file; check the path",
            ErrorKind::PermissionDenied => "not readable; check its permissions",
            ErrorKind::IsADirectory => "a folder, expected a file",
            _ => return Failure::Input(format!("{}: {error}", path.display())),
        };
        Failure::Input(format!("{}: {advice}", path.display()))
    })
}

/// Text of a UTF-8 file that the user named (a byte-order mark is dropped).
pub fn read_text(path: &Path) -> Result<String, Failure> {
    let text = String::from_utf8(read(path)?)
        .map_err(|error| Failure::Input(format!("{}: byte {} is not UTF-8; save the file as UTF-8", path.display(), error.utf8_error().valid_up_to())))?;
    Ok(text.strip_prefix('\u{feff}').map_or(text.clone(), str::to_owned))
}

/// Name of a file or folder for messages and headings.
pub fn display_name(path: &Path) -> String {
    let full = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    full.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// Writes every file of a command into `folder` (made if missing): all are staged beside their places first, then renamed.
pub fn write_all(folder: &Path, files: &[(&str, Vec<u8>)]) -> Result<(), Failure> {
    let failed = |what: &Path, error: std::io::Error| Failure::Internal(format!("{}: cannot be written: {error}", what.display()));
    fs::create_dir_all(folder).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists | ErrorKind::NotADirectory => Failure::Input(format!("{}: is a file, expected a folder for the results", folder.display())),
        _ => failed(folder, error),
    })?;
    let staged = files
        .iter()
        .map(|(name, bytes)| {
            let path = folder.join(name);
            let mut file = tempfile::Builder::new().permissions(readable_by_all()).tempfile_in(folder).map_err(|e| failed(&path, e))?;
            file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(|e| failed(&path, e))?;
            Ok((file, path))
        })
        .collect::<Result<Vec<_>, Failure>>()?;
    for (file, path) in staged {
        file.persist(&path).map_err(|e| failed(&path, e.error))?;
    }
    Ok(())
}

/// What a new file gets from an ordinary program (the user's mask still applies); temporary files are private otherwise.
#[cfg(unix)]
fn readable_by_all() -> fs::Permissions {
    std::os::unix::fs::PermissionsExt::from_mode(0o666)
}
