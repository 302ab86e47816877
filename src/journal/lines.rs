//! The lines of a file, whichever system or editor ended them: LF, CR LF or CR.

/// A line without its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RawLine<'a> {
    pub bytes: &'a [u8],
    /// Whether it has an end, which the last one may lack.
    pub ended: bool,
    /// Bytes of the file before the next line.
    pub end_offset: usize,
}

/// The lines of a file in order; none of an empty one.
pub(super) fn split_lines(bytes: &[u8]) -> impl Iterator<Item = RawLine<'_>> {
    let mut from = 0;
    std::iter::from_fn(move || {
        let rest = bytes.get(from..).filter(|rest| !rest.is_empty())?;
        let end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
        let length = end.unwrap_or(rest.len());
        from += length + end.map_or(0, |at| if rest[at..].starts_with(b"\r\n") { 2 } else { 1 });
        Some(RawLine { bytes: &rest[..length], ended: end.is_some(), end_offset: from })
    })
}

/// The line without the byte-order mark that an editor may have put before it.
pub(super) fn strip_byte_order_mark(line: &[u8]) -> &[u8] {
    line.strip_prefix("\u{feff}".as_bytes()).unwrap_or(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_end_of_a_line_counts_once() {
        let found: Vec<_> =
            split_lines(b"a\nbc\r\nd\re\n\nf").map(|l| (l.bytes, l.ended, l.end_offset)).collect();
        let expected: [(&[u8], bool, usize); 6] = [
            (b"a", true, 2),
            (b"bc", true, 6),
            (b"d", true, 8),
            (b"e", true, 10),
            (b"", true, 11),
            (b"f", false, 12),
        ];
        assert_eq!(found, expected);
        assert_eq!(split_lines(b"").count(), 0);
    }
}
