//! Exit codes and failures.

use crate::simulate::{RunResult, RunStatus};

/// Exit code: bad usage or bad input; nothing was written.
pub(crate) const BAD_INPUT: u8 = 2;
/// Exit code: the machine or the program failed.
pub(crate) const INTERNAL: u8 = 1;
/// Exit code: the command ran but stopped early; its partial results are written and marked as such.
pub(crate) const STOPPED_EARLY: u8 = 3;

/// Outcome of a command that did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CommandOutcome {
    Done,
    /// The command stopped early or did not converge; its partial results are written and marked as such.
    StoppedEarly,
}

impl CommandOutcome {
    pub(crate) fn done_if(done: bool) -> Self {
        if done { Self::Done } else { Self::StoppedEarly }
    }

    pub(crate) fn exit_code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::StoppedEarly => STOPPED_EARLY,
        }
    }
}

/// Result of a step of a command, or the reason why the command writes nothing.
pub(crate) type Outcome<T = CommandOutcome> = Result<T, Failure>;

/// Reason why a command wrote nothing.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Bad usage or bad input.
    #[error("{0}")]
    Input(String),
    /// The machine or the program failed.
    #[error("{0}")]
    Internal(String),
}

impl Failure {
    /// Failure due to bad input, from a typed error of the library.
    pub(crate) fn input(error: impl std::fmt::Display) -> Self {
        Self::Input(error.to_string())
    }

    /// Failure due to bad input, with the file or option that contains it.
    pub(crate) fn at(place: impl std::fmt::Display, problem: impl std::fmt::Display) -> Self {
        Self::Input(format!("{place}: {problem}"))
    }

    /// Failure due to a defect of the program or a failure of the machine.
    pub(crate) fn internal(error: impl std::fmt::Display) -> Self {
        Self::Internal(error.to_string())
    }

    /// Prints the message and returns the exit code.
    pub(crate) fn print_message(&self) -> u8 {
        // each problem of a file has its own line; only the first line is not indented
        for (i, line) in self.to_string().split('\n').enumerate() {
            warn_line!("{}{line}", if i == 0 { "error: " } else { "       " });
        }
        match self {
            Self::Input(_) => BAD_INPUT,
            Self::Internal(_) => INTERNAL,
        }
    }
}

/// Status, time and meaning of a run that ended early; `None` for a complete run.
pub(crate) fn describe_early_end(run: &RunResult) -> Option<String> {
    (run.status != RunStatus::Completed)
        .then(|| format!("{} at {} s: {}", run.status.name(), run.stopped_at_s, run.status.meaning()))
}
