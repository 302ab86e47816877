//! Where the lines of a journal go.

/// Takes lines as they are made; the program writes each to a file and flushes it.
pub trait Sink: Send {
    /// Appends one line, which ends with its newline.
    ///
    /// # Errors
    /// The reason in words; the computation stops.
    fn append(&mut self, line: &str) -> Result<(), String>;
}

/// Keeps nothing: for a computation that will not be resumed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Discard;

impl Sink for Discard {
    fn append(&mut self, _: &str) -> Result<(), String> {
        Ok(())
    }
}

/// Keeps the lines in memory.
impl Sink for String {
    fn append(&mut self, line: &str) -> Result<(), String> {
        self.push_str(line);
        Ok(())
    }
}
