//! Progress on a terminal, silence elsewhere.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};

/// What is going on, and the unit that it is counted in.
static PRESENT: Mutex<Option<(ProgressBar, &'static str, &'static str)>> = Mutex::new(None);

/// A bar over `total` steps of a unit such as `evaluations`; drawn unless `quiet`, where standard error is a
/// terminal.
pub fn bar(total: u64, what: &'static str, unit: &'static str, quiet: bool) -> ProgressBar {
    let is_drawn = !quiet && std::io::stderr().is_terminal();
    let target = if is_drawn { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(total), target);
    let template =
        format!("{{prefix}} {{bar:20}} {{pos}}/{{len}} {unit} ({{per_sec}}, {{eta}} left) {{wide_msg}}");
    bar.set_style(ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.set_prefix(what);
    *PRESENT.lock().unwrap_or_else(PoisonError::into_inner) = Some((bar.clone(), what, unit));
    bar
}

/// How far the present work has come, in words.
pub fn reached() -> Option<String> {
    let present = PRESENT.lock().unwrap_or_else(PoisonError::into_inner);
    let (bar, what, unit) = present.as_ref().filter(|(bar, ..)| !bar.is_finished())?;
    let (done, total) = (bar.position(), bar.length()?);
    Some(format!("{what} had done {done} of {total} {unit}"))
}

/// A line of progress to standard error, unless `quiet`.
pub fn say(quiet: bool, line: &str) {
    if !quiet {
        warn_line!("{line}");
    }
}
