//! Files beside an export that say more of it: Photron's `.cih` has the recording rate.

use super::export::Export;
use super::{Source, base_name, encoding};

/// Names of files that may lie beside `file` and belong to it, in the order in which they are asked.
#[must_use]
pub fn candidates(file: &str) -> Vec<String> {
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    let by_extension = ["cih", "CIH", "set", "SET"].iter().map(|extension| format!("{stem}.{extension}"));
    by_extension.chain(point_names(file)).collect()
}

/// DLTdv's list of point names beside a sparse table of positions.
fn point_names(file: &str) -> Option<String> {
    let (folder, base) = file.split_at(file.len() - base_name(file).len());
    base.rsplit_once("xypts").filter(|(_, end)| end.starts_with('.')).map(|(start, end)| format!("{folder}{start}pointNames{end}"))
}

/// Key of the recording rate in a `.cih`, which is text of `Key : value` lines.
const RECORD_RATE: &str = "record rate";

/// Takes the recording rate from the camera's record beside each file, where there is one.
pub(super) fn read_rates(sources: &[Source], exports: &mut [Export]) {
    for (source, export) in sources.iter().zip(exports) {
        let records = source.beside.iter().filter(|file| file.name.to_lowercase().ends_with(".cih"));
        let rates = records.filter_map(|file| {
            let text = encoding::decode(&file.name, &file.bytes, None).ok()?.text;
            Some((record_rate_hz(&text)?, format!("the camera's record {} beside it", base_name(&file.name))))
        });
        if let Some(rate) = rates.into_iter().next() {
            export.says.frame_rate_hz = Some(rate);
        }
    }
}

/// The rate of a Photron `.cih`, frames/s.
pub(super) fn record_rate_hz(text: &str) -> Option<f64> {
    let pairs = text.lines().filter_map(|line| line.split_once(':'));
    let mut rates = pairs.filter(|(key, _)| key.trim().to_lowercase().starts_with(RECORD_RATE)).filter_map(|(_, value)| value.trim().parse::<f64>().ok());
    rates.find(|rate| rate.is_finite() && *rate > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_of_a_cih_is_that_of_recording() {
        let text = "#Camera Information Header\nDate : 2020/1/1\nRecord Rate(fps) : 5000\nPlay Rate(fps) : 30\n";
        assert_eq!(record_rate_hz(text), Some(5000.0));
        assert_eq!(record_rate_hz("Record Rate(fps) : none\n"), None);
        assert!(candidates("a/run 7.csv").contains(&"a/run 7.cih".to_owned()));
        assert!(candidates("xypts/run7_xypts.tsv").contains(&"xypts/run7_pointNames.tsv".to_owned()));
        assert_eq!(candidates("xypts/run7.tsv").len(), 4);
    }
}
