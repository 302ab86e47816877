//! Pictures of the frames of a recording, from the folder named under `[video]` in its description.

use crate::cli::load::{LoadedRecording, description_path};
use crate::cli::prelude::*;
use crate::recording::files::{FilesError, PixelMapping};
use crate::recording::video::{Picture, PictureSource, RecordingVideo};
use std::fs;
use std::sync::{Mutex, PoisonError};

/// The pictures of a recording.
pub(crate) struct FramePictures {
    place: PixelMapping,
    first_frame: usize,
    files: Vec<PathBuf>,
    /// The failure of the first picture that could not be read.
    failed: Mutex<Option<Failure>>,
}

impl FramePictures {
    /// The pictures of the recording at `path`. `None` if its description names none, or if the tracks were
    /// interpolated to a grid: the frames of the grid are not those of the pictures.
    pub(crate) fn load(path: &Path, loaded: &LoadedRecording) -> Outcome<Option<Self>> {
        let file = loaded.file.as_ref().filter(|_| !loaded.recording.is_resampled());
        let Some((file, video)) = file.and_then(|file| Some((file, file.video.as_ref()?))) else {
            return Ok(None);
        };
        let described = description_path(path);
        let description = described.display().to_string();
        let place =
            video.pixel_mapping(&description, &file.camera, file.level.as_ref()).map_err(Failure::input)?;
        let frames = files::resolve_path(&described, &video.frames);
        let refuse = |found: &str| {
            let problem = format!(
                "found \"{}\", expected a folder of PNG pictures, a frame each, or one PNG, relative to this file; {} {found}",
                video.frames,
                frames.display()
            );
            Failure::input(FilesError::Video { file: description.clone(), key: "frames", problem })
        };
        let is_png = |path: &PathBuf| path.extension().is_some_and(|end| end.eq_ignore_ascii_case("png"));
        let mut files = vec![frames.clone()];
        if !(is_png(&frames) && frames.is_file()) {
            let entries = fs::read_dir(&frames).map_err(|e| refuse(&format!("cannot be read: {e}")))?;
            let is_picture = |path: &PathBuf| is_png(path) && path.is_file();
            files = entries.flatten().map(|entry| entry.path()).filter(is_picture).collect();
        }
        if files.is_empty() {
            return Err(refuse("holds none"));
        }
        files.sort_by_cached_key(|file| natural_sort_key(&file.to_string_lossy()));
        Ok(Some(Self { place, first_frame: video.first_frame, files, failed: Mutex::new(None) }))
    }

    pub(crate) fn as_film(&self) -> RecordingVideo<'_> {
        RecordingVideo { mapping: self.place, pictures: self }
    }

    /// Fails if a picture could not be read.
    pub(crate) fn check_pictures(&self) -> Outcome<()> {
        self.failed.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
    }
}

impl PictureSource for FramePictures {
    fn frame_picture(&self, frame: usize) -> Option<Picture> {
        let path = self.files.get(frame.checked_sub(self.first_frame)?)?;
        let refused = |error| Failure::at(path.display(), error);
        let read = files::read_data(path).and_then(|bytes| Picture::from_png(&bytes).map_err(refused));
        read.map_err(|failure| {
            self.failed.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(failure);
        })
        .ok()
    }
}

/// Sort key that puts frame9 before frame10: of two numbers, the one with fewer digits comes first; numbers
/// with equally many digits are compared as text. Names with equal keys are ordered by the whole name.
fn natural_sort_key(name: &str) -> (Vec<(usize, String)>, String) {
    let mut parts: Vec<(bool, String)> = Vec::new();
    for letter in name.chars() {
        let digit = letter.is_ascii_digit();
        match parts.last_mut() {
            Some((of_digits, part)) if *of_digits == digit => part.push(letter),
            _ => parts.push((digit, letter.to_string())),
        }
    }
    let key = |(digits, part): (bool, String)| {
        let number = part.trim_start_matches('0');
        if digits { (number.len(), number.to_owned()) } else { (0, part) }
    };
    (parts.into_iter().map(key).collect(), name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_in_the_order_of_their_numbers() {
        let mut names = ["f10.png", "f9.png", "f09.png", "e11.png", "f1.png", "f100000000000000000000.png"];
        names.sort_by_cached_key(|name| natural_sort_key(name));
        assert_eq!(
            names,
            ["e11.png", "f1.png", "f09.png", "f9.png", "f10.png", "f100000000000000000000.png"]
        );
    }
}
