//! Reads the start tags of XML elements, with their places in the file. This is the only module that uses
//! `quick_xml`.
//!
//! Elements are read one by one, so deep nesting cannot overflow the stack. Only the five predefined entities
//! and character references are resolved; a document type, which could define others, is refused.

use crate::import::format::*;
use crate::import::reader::rows::count_lines;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

const REMEDY: &str = "save or export it again from TrackMate";

/// Reads the elements of a document in their order.
pub(crate) struct XmlReader<'a> {
    file: &'a str,
    text: &'a str,
    reader: Reader<&'a [u8]>,
    /// Number of elements that are open, i.e. not yet closed.
    depth: usize,
    /// Byte offset up to which lines have been counted, and the line number at this offset.
    counted: (usize, usize),
}

/// Start of an element.
pub(crate) struct XmlElement<'a> {
    bytes: BytesStart<'a>,
    start: usize,
    pub line: usize,
}

impl XmlElement<'_> {
    pub(crate) fn name(&self) -> &str {
        self.bytes.name().into_inner()
    }
}

impl<'a> XmlReader<'a> {
    pub(crate) fn new(document: &'a Document) -> Self {
        let mut reader = Reader::from_str(document.text);
        reader.config_mut().expand_empty_elements = true;
        Self { file: document.file, text: document.text, reader, depth: 0, counted: (0, 1) }
    }

    /// Name of the root element; `None` if the text is not XML.
    pub(crate) fn root_name(document: &Document) -> Option<String> {
        if !document.text.trim_start().starts_with('<') {
            return None;
        }
        let element = XmlReader::new(document).next_element().ok()??;
        Some(element.name().to_owned())
    }

    /// The start of the next element; `None` after the last one.
    ///
    /// # Errors
    /// [`ImportError::WrongTable`] if the text is not well-formed, ends within an element, or has a document
    /// type.
    pub(crate) fn next_element(&mut self) -> ImportResult<Option<XmlElement<'a>>> {
        loop {
            let start = self.clamp_offset(self.reader.buffer_position());
            match self.reader.read_event() {
                Ok(Event::Start(bytes)) => {
                    self.depth += 1;
                    let line = self.line_at(start);
                    return Ok(Some(XmlElement { bytes, start, line }));
                }
                Ok(Event::End(_)) => self.depth = self.depth.saturating_sub(1),
                Ok(Event::DocType(_)) => {
                    return Err(self.damaged_error(start, "a document type definition".to_owned()));
                }
                Ok(Event::Eof) if self.depth > 0 => {
                    let found = format!("the end of the file within {} open elements", self.depth);
                    return Err(self.damaged_error(self.text.trim_end().len(), found));
                }
                Ok(Event::Eof) => return Ok(None),
                Ok(_) => {}
                Err(error) => {
                    let at = self.clamp_offset(self.reader.error_position());
                    let found = format!("XML that is damaged or broken off ({error})");
                    return Err(self.damaged_error(at, found));
                }
            }
        }
    }

    /// Value of the attribute `name`; `None` if the element does not have it.
    ///
    /// # Errors
    /// [`ImportError::WrongTable`] for attributes that are not well-formed and for entities that are not
    /// predefined.
    pub(crate) fn attribute(&self, element: &XmlElement, name: &str) -> ImportResult<Option<String>> {
        let damaged = |error: String| {
            self.damaged_error(element.start, format!("an attribute that cannot be read ({error})"))
        };
        for attribute in element.bytes.attributes().with_checks(false) {
            let attribute = attribute.map_err(|error| damaged(error.to_string()))?;
            if attribute.key.as_ref() == name {
                let value = attribute.normalized_value(XmlVersion::Explicit1_0);
                return Ok(Some(value.map_err(|error| damaged(error.to_string()))?.into_owned()));
            }
        }
        Ok(None)
    }

    /// Value of an attribute that the element must have.
    ///
    /// # Errors
    /// [`ImportError::WrongTable`] if the attribute is missing.
    pub(crate) fn required_attribute(&self, element: &XmlElement, name: &str) -> ImportResult<String> {
        self.attribute(element, name)?.ok_or_else(|| {
            let found = format!("<{}> without {name}", element.name());
            let place = self.element_location(element);
            ImportError::wrong_table(place, found, format!("the attribute {name}"), REMEDY)
        })
    }

    /// Number in an attribute that the element must have; `None` if the attribute contains a word for a
    /// missing value.
    ///
    /// # Errors
    /// [`ImportError::WrongTable`] if the attribute is missing; [`ImportError::Other`] if it contains other
    /// text.
    pub(crate) fn number_attribute(&self, element: &XmlElement, name: &str) -> ImportResult<Option<f64>> {
        let text = self.required_attribute(element, name)?;
        match parse_number(text.trim(), '.') {
            CellNumber::Value(value) => Ok(Some(value)),
            CellNumber::Missing => Ok(None),
            CellNumber::Text => {
                let remedy = ("a number with a decimal point", REMEDY);
                let place = self.element_location(element);
                Err(ImportError::cell(place, (name, &text), remedy))
            }
        }
    }

    /// The place of an element in the file, for messages.
    pub(crate) fn element_location(&self, element: &XmlElement) -> TextLocation {
        self.location_at(element.start)
    }

    fn damaged_error(&self, at: usize, found: String) -> ImportError {
        ImportError::wrong_table(self.location_at(at), found, "a whole file as TrackMate writes it", REMEDY)
    }

    fn clamp_offset(&self, offset: u64) -> usize {
        usize::try_from(offset).unwrap_or(usize::MAX).min(self.text.len())
    }

    /// Line number at byte `at` of the text. From call to call, `at` must not decrease.
    fn line_at(&mut self, at: usize) -> usize {
        let (from, line) = self.counted;
        let line = line + count_lines(self.text.as_bytes().get(from..at).unwrap_or_default());
        self.counted = (at, line);
        line
    }

    fn location_at(&self, at: usize) -> TextLocation {
        let before = self.text.as_bytes().get(..at).unwrap_or_default();
        let line = count_lines(before) + 1;
        let start = before.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        let column = self.text.get(start..at).map_or(1, |text| text.chars().count() + 1);
        TextLocation { file: self.file.to_owned(), line, column }
    }
}
