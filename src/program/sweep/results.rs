//! The files of a study, from its points.

use super::problem::{Problem, failure};
use crate::chart::Figure;
use crate::figures::{sweep_map, sweep_sheet};
use crate::program::failure::{Failure, Outcome};
use crate::program::files::{self, Place, Writer};
use crate::program::global::Global;
use crate::sweep::outputs::{Summary, csv_header, csv_row};
use crate::sweep::{Collection, Outcome as Point, RankCorrelations, Reason, SHEET, Study};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

const TABLE: &str = "sweep.csv";
const SUMMARY: &str = "summary.json";

impl Problem {
    /// Checks that a study can write its files into a folder.
    pub fn check_place(&self, out: &Path, writer: &Writer) -> Result<Place, Failure> {
        let sheet = self.study.has_sheet().then_some(SHEET);
        let mapped = self.study.maps.iter().filter(|_| self.study.is_mapped());
        let maps = mapped.map(|map| map.slug.as_str()).chain(sheet).map(|name| format!("{name}.svg"));
        let names: Vec<String> = [TABLE, SUMMARY].map(str::to_owned).into_iter().chain(maps).collect();
        Place::check(out, writer, &names.iter().map(String::as_str).collect::<Vec<_>>())
    }

    /// Writes table, summary and figures of a study of which every point is known.
    pub fn write(
        &self,
        points: &mut Collection<File>,
        out: &Path,
        writer: &Writer,
        global: &Global,
    ) -> Result<Outcome, Failure> {
        let place = self.check_place(out, writer)?;
        let mut table = place.file(TABLE)?;
        table.write(&csv_header(&self.study));
        let mut summary = Summary::new(&self.study, self.scene.title(), &self.fingerprint);
        let (mut mapped, mut correlations) = (Vec::new(), RankCorrelations::new(&self.study));
        let is_mapped = self.study.is_mapped();
        let each = |index: usize, outcome: Point| {
            table.write(&csv_row(&self.study, index, &outcome));
            warn_of_panic(index, &outcome);
            summary.count(&outcome);
            if is_mapped {
                mapped.push(outcome);
            } else {
                correlations.look(&self.study, index, &outcome);
            }
        };
        points.each(each).map_err(failure)?;
        if !is_mapped {
            summary.correlate(&self.study, &correlations);
        }
        let maps = self.study.maps.iter().enumerate().filter(|_| is_mapped);
        let drawn = maps.flat_map(|(at, map)| {
            files::drawn(&map.slug, &sweep_map::figure(&self.study, &self.scene, &mapped, at))
        });
        let mut others: Vec<(String, Vec<u8>)> = drawn.collect();
        if self.study.has_sheet() {
            others.extend(files::drawn(SHEET, &self.sheet(&mapped, &correlations)));
        }
        others.push((SUMMARY.to_owned(), summary.to_json().map_err(Failure::internal)?.into_bytes()));
        place.finish(vec![table], &others)?;
        if !global.quiet {
            print_summary(&self.study, &summary);
            print_line!("written to {}", out.display());
        }
        Ok(if summary.shows_something() { Outcome::Done } else { Outcome::StoppedEarly })
    }

    /// Every map in one figure.
    fn sheet(&self, mapped: &[Point], correlations: &RankCorrelations) -> Figure {
        match self.study.is_mapped() {
            true => sweep_sheet::figure(&self.study, &self.scene, mapped),
            false => sweep_sheet::correlations(&self.study, correlations),
        }
    }
}

/// A panic is a fault of the program, not of the study, and must not pass for one.
fn warn_of_panic(index: usize, point: &Point) {
    if let Some(ended) = point.ended.as_ref().filter(|ended| ended.reason == Reason::Panicked) {
        warn_line!(
            "warning: point {} of the study: the program failed: {}; please report it",
            index + 1,
            ended.why
        );
    }
}

fn print_summary(study: &Study, summary: &Summary) {
    let counts = |counts: &BTreeMap<&str, usize>| {
        counts.iter().map(|(word, n)| format!("{n} {word}")).collect::<Vec<_>>().join(", ")
    };
    print_line!("{}: {} simulated runs: {}", summary.title, summary.points, counts(&summary.status));
    for axis in &study.axes {
        let ends = axis.values.first().zip(axis.values.last());
        let (from, to) = ends.map_or((0.0, 0.0), |(from, to)| (*from, *to));
        let values = match study.sample {
            Some(_) => "sampled".to_owned(),
            None => format!("{} values", axis.values.len()),
        };
        print_line!("over {}: {values} from {from} to {to}", axis.parameter.name);
    }
    print_line!("{:<28} {:>9} {:>13} {:>13}  without a value", "map", "values", "least", "greatest");
    for map in &summary.maps {
        let end = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.6}"));
        print_line!(
            "{:<28} {:>9} {:>13} {:>13}  {}",
            map.column,
            map.values,
            end(map.least),
            end(map.greatest),
            counts(&map.missing)
        );
    }
}
