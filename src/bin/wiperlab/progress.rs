//! Progress on a terminal, silence elsewhere.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// What is going on, and the unit that it is counted in.
static PRESENT: Mutex<Option<(ProgressBar, &'static str, &'static str)>> = Mutex::new(None);

/// A bar over `total` steps of a unit such as `evaluations`; drawn unless `quiet`, where standard error is a
/// terminal.
pub fn bar(total: u64, what: &'static str, unit: &'static str, quiet: bool) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(total), target(quiet));
    let template =
        format!("{{prefix}} {{bar:20}} {{pos}}/{{len}} {unit} ({{per_sec}}, {{eta}} left) {{wide_msg}}");
    bar.set_style(ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.set_prefix(what);
    *PRESENT.lock().unwrap_or_else(PoisonError::into_inner) = Some((bar.clone(), what, unit));
    bar
}

/// Work in steps of unknown length.
pub struct Steps(ProgressBar);

/// Steps of a command; drawn as a [`bar`] is.
pub fn steps(what: &'static str, quiet: bool) -> Steps {
    /// From one sign of life to the next.
    const TICK: Duration = Duration::from_millis(200);
    let bar = ProgressBar::with_draw_target(None, target(quiet));
    let style = ProgressStyle::with_template("{spinner} {prefix}: {wide_msg} {elapsed}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
    bar.set_prefix(what);
    if !bar.is_hidden() {
        bar.enable_steady_tick(TICK);
    }
    *PRESENT.lock().unwrap_or_else(PoisonError::into_inner) = Some((bar.clone(), what, ""));
    Steps(bar)
}

impl Steps {
    /// The next step, such as `reading the recording`.
    pub fn on(&self, step: &'static str) {
        self.0.set_message(step);
    }
}

impl Drop for Steps {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

fn target(quiet: bool) -> ProgressDrawTarget {
    let is_drawn = !quiet && std::io::stderr().is_terminal();
    if is_drawn { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() }
}

/// How far the present work has come, in words; nothing more is drawn of it.
pub fn reached() -> Option<String> {
    let present = PRESENT.lock().unwrap_or_else(PoisonError::into_inner);
    let (bar, what, unit) = present.as_ref().filter(|(bar, ..)| !bar.is_finished())?;
    let reached = match bar.length() {
        Some(total) => format!("{what} had done {} of {total} {unit}", bar.position()),
        None => format!("{what} was {}", bar.message()),
    };
    bar.finish_and_clear();
    Some(reached)
}

/// A line of progress to standard error, unless `quiet`.
pub fn say(quiet: bool, line: &str) {
    if !quiet {
        warn_line!("{line}");
    }
}
