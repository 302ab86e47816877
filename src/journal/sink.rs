//! Where the lines of a journal go.

/// Takes lines as they are made. When it returns they are where they stay: the program has written them to a
/// file, and the disk has them. Only then is a record counted or reported.
pub trait CheckpointSink: Send {
    /// Appends one line or several, each with its newline.
    ///
    /// # Errors
    /// The reason in words; the computation stops.
    fn append(&mut self, lines: &str) -> Result<(), String>;
}

/// Keeps nothing: for a computation that will not be resumed.
#[derive(Debug, Clone, Copy, Default)]
pub struct NullSink;

impl CheckpointSink for NullSink {
    fn append(&mut self, _: &str) -> Result<(), String> {
        Ok(())
    }
}

/// Keeps the lines in memory.
impl CheckpointSink for String {
    fn append(&mut self, lines: &str) -> Result<(), String> {
        self.push_str(lines);
        Ok(())
    }
}
