//! The table of a study as Apache Parquet: the rows and columns of `sweep.csv`, with types, for data frames.

use super::outputs::{SOURCE, missing};
use super::point::Outcome;
use super::study::{Map, Study};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use std::io::Write;
use std::sync::Arc;

/// Rows that are written together: some megabytes in memory.
const ROWS: usize = 65_536;

/// A table that grows by a point at a time.
pub struct Table<W: Write + Send> {
    writer: SerializedFileWriter<W>,
    rows: Rows,
}

/// Columns of the rows that are not written yet.
#[derive(Default)]
struct Rows {
    points: Vec<i64>,
    axes: Vec<Vec<f64>>,
    status: Vec<ByteArray>,
    stopped_at_s: Sparse,
    maps: Vec<Sparse>,
    missing: Vec<ByteArray>,
}

/// Numbers, and for each row whether it has one.
#[derive(Default)]
struct Sparse {
    values: Vec<f64>,
    present: Vec<i16>,
}

impl Sparse {
    fn push(&mut self, value: Option<f64>) {
        self.present.push(i16::from(value.is_some()));
        self.values.extend(value);
    }
}

impl Rows {
    fn of(study: &Study) -> Self {
        let maps = study.maps.iter().map(|_| Sparse::default()).collect();
        Self { axes: vec![Vec::new(); study.axes.len()], maps, ..Self::default() }
    }
}

impl<W: Write + Send> Table<W> {
    /// An empty table; `fingerprint` is that of the study and its scene.
    ///
    /// # Errors
    /// [`ParquetError`] where nothing can be written.
    pub fn new(study: &Study, fingerprint: &str, to: W) -> Result<Self, ParquetError> {
        let said = [
            ("title", study.title.as_str()),
            ("source", SOURCE),
            ("synthetic", "true"),
            ("fingerprint", fingerprint),
            ("wiperlab", env!("CARGO_PKG_VERSION")),
        ];
        let said = said.map(|(key, value)| KeyValue::new(key.to_owned(), value.to_owned()));
        let properties = WriterProperties::builder().set_key_value_metadata(Some(said.into())).build();
        let writer = SerializedFileWriter::new(to, Arc::new(schema(study)?), Arc::new(properties))?;
        Ok(Self { writer, rows: Rows::of(study) })
    }

    /// Adds a point.
    ///
    /// # Errors
    /// [`ParquetError`] where nothing can be written.
    pub fn push(&mut self, study: &Study, index: usize, outcome: &Outcome) -> Result<(), ParquetError> {
        let rows = &mut self.rows;
        rows.points.push(index as i64);
        rows.axes.iter_mut().zip(study.place(index)).for_each(|(axis, value)| axis.push(value));
        rows.status.push(outcome.status().into());
        rows.stopped_at_s.push(outcome.stopped_at_s);
        rows.maps.iter_mut().zip(&outcome.values).for_each(|(map, value)| map.push(value.ok()));
        rows.missing.push(missing(study, outcome).as_str().into());
        if rows.points.len() < ROWS {
            return Ok(());
        }
        let full = std::mem::replace(rows, Rows::of(study));
        self.write(full)
    }

    /// Writes what is left and the end of the file, and gives back where it was written to.
    ///
    /// # Errors
    /// [`ParquetError`] where nothing can be written.
    pub fn finish(mut self) -> Result<W, ParquetError> {
        let rows = std::mem::take(&mut self.rows);
        self.write(rows)?;
        self.writer.into_inner()
    }

    fn write(&mut self, rows: Rows) -> Result<(), ParquetError> {
        let count = rows.points.len();
        if count == 0 {
            return Ok(());
        }
        let source = vec![ByteArray::from(SOURCE); count];
        let mut group = self.writer.next_row_group()?;
        column::<Int64Type, W>(&mut group, &rows.points, None)?;
        for axis in &rows.axes {
            column::<DoubleType, W>(&mut group, axis, None)?;
        }
        column::<ByteArrayType, W>(&mut group, &rows.status, None)?;
        for sparse in std::iter::once(&rows.stopped_at_s).chain(&rows.maps) {
            column::<DoubleType, W>(&mut group, &sparse.values, Some(&sparse.present))?;
        }
        column::<ByteArrayType, W>(&mut group, &rows.missing, None)?;
        column::<ByteArrayType, W>(&mut group, &source, None)?;
        group.close().map(|_| ())
    }
}

/// Writes the next column of a row group; `present` says which rows have a value, where not all have.
fn column<T: DataType, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[T::T],
    present: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let Some(mut column) = group.next_column()? else {
        return Err(ParquetError::General("the table has fewer columns than its rows".to_owned()));
    };
    column.typed::<T>().write_batch(values, present, None)?;
    column.close()
}

fn schema(study: &Study) -> Result<Type, ParquetError> {
    let field = |name: &str, physical, repetition| {
        let text = (physical == Physical::BYTE_ARRAY).then_some(LogicalType::String);
        let built = Type::primitive_type_builder(name, physical).with_repetition(repetition);
        built.with_logical_type(text).build().map(Arc::new)
    };
    let number = |name: &str| field(name, Physical::DOUBLE, Repetition::OPTIONAL);
    let text = |name: &str| field(name, Physical::BYTE_ARRAY, Repetition::REQUIRED);
    let mut fields = vec![field("point", Physical::INT64, Repetition::REQUIRED)?];
    for axis in &study.axes {
        fields.push(field(axis.parameter.name, Physical::DOUBLE, Repetition::REQUIRED)?);
    }
    fields.extend([text("status")?, number("stopped_at_s")?]);
    for name in study.maps.iter().map(Map::column) {
        fields.push(number(&name)?);
    }
    fields.extend([text("missing")?, text("source")?]);
    Type::group_type_builder("study").with_fields(fields).build()
}
