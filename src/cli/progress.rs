//! Shows progress on a terminal, and nothing elsewhere.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The bar of the current work, the name of that work, and the unit of its steps.
static CURRENT_WORK: Mutex<Option<(ProgressBar, &'static str, &'static str)>> = Mutex::new(None);

/// A bar for `total` steps, counted in a unit such as `evaluations`. It is drawn if standard error is a
/// terminal, unless `quiet`.
pub(crate) fn start_bar(total: u64, what: &'static str, unit: &'static str, quiet: bool) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(total), draw_target(quiet));
    let template =
        format!("{{prefix}} {{bar:20}} {{pos}}/{{len}} {unit} ({{per_sec}}, {{eta}} left) {{wide_msg}}");
    bar.set_style(ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.set_prefix(what);
    *CURRENT_WORK.lock().unwrap_or_else(PoisonError::into_inner) = Some((bar.clone(), what, unit));
    bar
}

/// Spinner for work whose steps have unknown durations.
pub(crate) struct StepSpinner(ProgressBar);

/// Shows the steps of a command; drawn under the same conditions as [`start_bar`].
pub(crate) fn start_steps(what: &'static str, quiet: bool) -> StepSpinner {
    /// Interval of the spinner.
    const TICK: Duration = Duration::from_millis(200);
    let bar = ProgressBar::with_draw_target(None, draw_target(quiet));
    let style = ProgressStyle::with_template("{spinner} {prefix}: {wide_msg} {elapsed}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
    bar.set_prefix(what);
    if !bar.is_hidden() {
        bar.enable_steady_tick(TICK);
    }
    *CURRENT_WORK.lock().unwrap_or_else(PoisonError::into_inner) = Some((bar.clone(), what, ""));
    StepSpinner(bar)
}

impl StepSpinner {
    /// Shows the next step, such as `reading the recording`.
    pub(crate) fn show_step(&self, step: &'static str) {
        self.0.set_message(step);
    }
}

impl Drop for StepSpinner {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

fn draw_target(quiet: bool) -> ProgressDrawTarget {
    let is_drawn = !quiet && std::io::stderr().is_terminal();
    if is_drawn { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() }
}

/// Ends the current bar, and returns its progress as text.
pub(crate) fn finish_in_words() -> Option<String> {
    let present = CURRENT_WORK.lock().unwrap_or_else(PoisonError::into_inner);
    let (bar, what, unit) = present.as_ref().filter(|(bar, ..)| !bar.is_finished())?;
    let reached = match bar.length() {
        Some(total) => format!("{what} had done {} of {total} {unit}", bar.position()),
        None => format!("{what} was {}", bar.message()),
    };
    bar.finish_and_clear();
    Some(reached)
}

/// Prints a line of progress to standard error, unless `quiet`.
pub(crate) fn print_progress(quiet: bool, line: &str) {
    if !quiet {
        warn_line!("{line}");
    }
}

/// Prints the progress of a bar that is not drawn, for example to the log of a batch system.
pub(crate) struct ProgressReporter {
    bar: ProgressBar,
    due: Mutex<Option<Instant>>,
}

impl ProgressReporter {
    /// Time between two printed lines of progress.
    const PAUSE: Duration = Duration::from_secs(60);
    /// Time from the start of the work to the first printed line of progress; it is short, so that a mistake
    /// shows early.
    const FIRST: Duration = Duration::from_secs(10);

    /// A reporter of the progress of `bar`. It prints nothing if `says` is false or if the bar is drawn on a
    /// terminal.
    pub(crate) fn new(bar: &ProgressBar, says: bool) -> Self {
        let due = (says && bar.is_hidden()).then(|| Instant::now() + Self::FIRST);
        Self { bar: bar.clone(), due: Mutex::new(due) }
    }

    /// Prints a line of progress if enough time has passed since the previous line.
    pub(crate) fn report_if_due(&self) {
        let now = Instant::now();
        let mut due = self.due.lock().unwrap_or_else(PoisonError::into_inner);
        if due.is_none_or(|due| now < due) {
            return;
        }
        *due = Some(now + Self::PAUSE);
        let (done, all) = (self.bar.position(), self.bar.length().unwrap_or_default());
        let left_s = self.bar.elapsed().as_secs_f64() / done.max(1) as f64 * all.saturating_sub(done) as f64;
        warn_line!("{done} of {all} done, about {} left", format_duration(left_s));
    }
}

/// A time in the largest suitable unit.
fn format_duration(time_s: f64) -> String {
    match time_s {
        time_s if time_s < 90.0 => format!("{time_s:.0} s"),
        time_s if time_s < 5400.0 => format!("{:.0} min", time_s / 60.0),
        time_s => format!("{:.1} h", time_s / 3600.0),
    }
}
