//! Progress on a terminal, silence elsewhere.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};

/// A line of results to standard output; a reader that has gone away (`| head`) is no error.
macro_rules! print_line {
    ($($words:tt)*) => {
        $crate::progress::line(&mut std::io::stdout().lock(), format_args!($($words)*))
    };
}

/// A message to standard error.
macro_rules! warn_line {
    ($($words:tt)*) => {
        $crate::progress::line(&mut std::io::stderr().lock(), format_args!($($words)*))
    };
}

/// Writes a line, or nothing where nobody reads.
pub fn line(to: &mut impl Write, words: std::fmt::Arguments<'_>) {
    let _ = writeln!(to, "{words}"); // the exit code tells the outcome to whoever does not read
}

/// A bar over `total` evaluations; hidden when `quiet` or when standard error is no terminal.
pub fn bar(total: u64, what: &str, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
    let template = "{prefix} {bar:20} {pos}/{len} ({per_sec}, {eta} left) {wide_msg}";
    bar.set_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.set_prefix(what.to_owned());
    bar
}

/// A line of progress to standard error, unless `quiet`.
pub fn say(quiet: bool, line: &str) {
    if !quiet {
        warn_line!("{line}");
    }
}
