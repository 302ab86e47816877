//! The table of a study as Parquet holds what `sweep.csv` holds.

use crate::shards::{project, run};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::fs::{self, File};

#[test]
fn a_parquet_table_has_the_rows_of_the_csv_to_the_last_bit_and_nulls_where_it_is_empty() {
    let project = project();
    assert_eq!(run(&project, &["sweep", "study.toml", "--out", "one", "--parquet"]).0, 0);
    let csv = fs::read_to_string(project.path().join("one/sweep.csv")).unwrap();
    let path = project.path().join("one/sweep.parquet");
    let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
    let said = reader.metadata().file_metadata().key_value_metadata().unwrap();
    assert!(said.iter().any(|said| said.key == "synthetic" && said.value.as_deref() == Some("true")));
    let rows: Vec<Vec<(String, Field)>> =
        reader.get_row_iter(None).unwrap().map(|row| row.unwrap().into_columns()).collect();
    let mut lines = csv.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!(rows.len(), 60);
    let mut nulls = 0;
    for (index, (row, line)) in rows.iter().zip(lines).enumerate() {
        let (found, first) = (row[1..].iter(), &row[0]);
        assert_eq!(*first, ("point".to_owned(), Field::Long(index as i64)));
        for (((name, field), cell), expected) in found.zip(line.split(',')).zip(&names) {
            assert_eq!(name, expected);
            match field {
                Field::Double(number) => assert_eq!(number.to_bits(), cell.parse::<f64>().unwrap().to_bits()),
                Field::Str(text) => assert_eq!(text, cell),
                Field::Null => nulls += usize::from(cell.is_empty()),
                other => panic!("{other:?}"),
            }
        }
    }
    let empty = csv.lines().skip(1).flat_map(|line| line.split(',')).filter(|cell| cell.is_empty()).count();
    let nothing_missing = csv.lines().skip(1).filter(|line| line.ends_with(",,simulation")).count();
    assert_eq!(nulls, empty - nothing_missing);

    // divided, it is the same file, and it goes where it is not asked for again
    let shard = ["sweep", "study.toml", "--out", "many", "--shard", "0/1"];
    assert_eq!(run(&project, &shard).0, 0);
    assert_eq!(run(&project, &["collect", "many", "--parquet"]).0, 0);
    assert_eq!(fs::read(project.path().join("many/sweep.parquet")).unwrap(), fs::read(&path).unwrap());
    assert_eq!(run(&project, &["collect", "many"]).0, 0);
    assert!(!project.path().join("many/sweep.parquet").exists());
    let (code, _, err) = run(&project, &[&shard[..], &["--parquet"]].concat());
    assert!(code == 2 && err.contains("--parquet"), "{err}");
}
