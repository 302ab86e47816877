//! `wiperlab journal drop`.

use super::backup::keep;
use super::file;
use super::work::{Work, no_header};
use crate::journal::{Kind, Tabled, Without, kind_of, without};
use crate::program::failure::{Failure, Outcome};
use crate::program::files;
use crate::program::global::Global;
use clap::Args;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub struct DropArgs {
    /// Journal of a fit or study
    pub journal: PathBuf,
    /// Lines to remove, counted from 1 as in messages: 17, 17..20 (both included), or 17.. for all from there
    #[arg(required = true, value_name = "LINES", value_parser = range, allow_negative_numbers = true)]
    pub lines: Vec<RangeInclusive<usize>>,
}

/// `17`, `17..20` or `17..`.
fn range(text: &str) -> Result<RangeInclusive<usize>, String> {
    let number = |text: &str| {
        text.parse::<usize>()
            .map_err(|_| format!("found \"{text}\", expected a line such as 17, 17..20 or 17.."))
    };
    let (from, to) = match text.split_once("..") {
        None => (number(text)?, number(text)?),
        Some((from, "")) => (number(from)?, usize::MAX),
        Some((from, to)) => (number(from)?, number(to)?),
    };
    if from <= to { Ok(from..=to) } else { Err(format!("{from} is behind {to}; exchange them")) }
}

struct Drop<'a>(&'a [RangeInclusive<usize>]);

impl Work for Drop<'_> {
    type Made = (Kind, Without);

    fn with<R: Tabled>(&self, name: &str, bytes: &[u8]) -> Result<(Kind, Without), Failure> {
        let left = without::<R>(name, bytes, self.0).map_err(Failure::input)?;
        Ok((R::KIND, left.ok_or_else(|| no_header(name))?))
    }
}

impl DropArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let path = &self.journal;
        let kind = kind_of(&files::read(path)?).unwrap_or(Kind::Fit);
        let lock = file::locked(path, kind)?;
        let bytes = lock.as_ref().map_or_else(|| files::read(path), |file| files::read_open(path, file))?;
        let (kind, left) = Drop(&self.lines).of_bytes(path, &bytes)?;
        let unkept = |error| Failure::Internal(format!("{}: cannot be kept: {error}", path.display()));
        let kept = keep(path, &bytes).map_err(unkept)?;
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else {
            return Err(Failure::Input(format!("{}: expected the name of a file", path.display())));
        };
        files::write_all(path.parent().unwrap_or(Path::new("")), &[(name, left.text.into_bytes())])?;
        std::mem::drop(lock); // nobody else has written meanwhile
        warn_line!("{}: the old journal is kept as {}", path.display(), kept.display());
        if !global.quiet {
            let (removed, count) = (left.removed, left.kept);
            print_line!("{}: {removed} removed, {count} {}s left", path.display(), kind.record());
        }
        Ok(Outcome::Done)
    }
}
