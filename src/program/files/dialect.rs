//! Tables as a spreadsheet opens them.

use clap::ValueEnum;
use std::io::{self, Read, Write};

/// How tables are written for those who open them with a double click.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum CsvDialect {
    /// Commas between cells, decimal points (RFC 4180 with line feeds): what every program reads
    #[default]
    Plain,
    /// Excel where a comma is decimal, as in Germany: semicolons between cells, decimal commas
    ExcelDe,
    /// Excel where a point is decimal, as in the US
    ExcelUs,
}

/// What tells Excel that a file is UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

impl CsvDialect {
    /// Whether a table that is written with commas and points has to be written anew.
    pub fn needs_conversion(self) -> bool {
        self != Self::Plain
    }

    /// A table in this dialect. Cells that are numbers get its decimal mark, all others stay as they are.
    pub fn convert_table(self, plain: impl Read, mut to: impl Write) -> io::Result<()> {
        to.write_all(BYTE_ORDER_MARK)?;
        let decimal_comma = self == Self::ExcelDe;
        let mut table = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(plain);
        let mut writer = csv::WriterBuilder::new();
        writer.delimiter(if decimal_comma { b';' } else { b',' }).flexible(true);
        let mut writer = writer.terminator(csv::Terminator::CRLF).from_writer(to);
        for row in table.records() {
            let row = row?;
            let cells = row.iter().map(|cell| {
                let decimal = decimal_comma && cell.contains('.') && cell.parse::<f64>().is_ok();
                if decimal { cell.replace('.', ",") } else { cell.to_owned() }
            });
            writer.write_record(cells)?;
        }
        writer.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: &str = "time_s,name,x_m\n0.5,\"a, b\",-1.5e-3\n1,\"1;2\",\n2,friction.a,1e5\n";

    fn converted(dialect: CsvDialect) -> String {
        let mut found = Vec::new();
        dialect.convert_table(PLAIN.as_bytes(), &mut found).unwrap();
        String::from_utf8(found).unwrap()
    }

    #[test]
    fn numbers_get_decimal_commas_and_texts_stay() {
        let german = "\u{feff}time_s;name;x_m\r\n0,5;a, b;-1,5e-3\r\n1;\"1;2\";\r\n2;friction.a;1e5\r\n";
        assert_eq!(converted(CsvDialect::ExcelDe), german);
    }

    #[test]
    fn points_stay_points() {
        let american = "\u{feff}".to_owned() + &PLAIN.replace('\n', "\r\n").replace("\"1;2\"", "1;2");
        assert_eq!(converted(CsvDialect::ExcelUs), american);
    }
}
