//! Writes the files of a study from its points.

use super::{LoadedStudy, collection_failure};
use crate::cli::prelude::*;
use crate::figures::{sweep_map, sweep_sheet};
use crate::sweep::outputs::{SweepSummary, csv_header, csv_row};
use crate::sweep::{
    MissingReason, PointCollection, PointOutcome as Point, RankCorrelations, SHEET_NAME, Study,
};
use plain_charts::Figure;
use std::collections::BTreeMap;
use std::fs::File;

const TABLE: &str = "sweep.csv";
const SUMMARY: &str = "summary.json";

impl LoadedStudy {
    /// Checks that the study can write its files into a folder.
    pub(crate) fn check_outputs(&self, out: &Path, writer: &WritePolicy) -> Outcome<OutputFolder> {
        let sheet = self.study.has_sheet().then_some(SHEET_NAME);
        let mapped = self.study.maps.iter().filter(|_| self.study.is_mapped());
        let maps = mapped.map(|map| map.slug.as_str()).chain(sheet).map(|name| format!("{name}.svg"));
        let names: Vec<String> = [TABLE, SUMMARY].map(str::to_owned).into_iter().chain(maps).collect();
        OutputFolder::check(out, writer, &names.iter().map(String::as_str).collect::<Vec<_>>())
    }

    /// Writes table, summary and figures of a study for which every point is known.
    pub(crate) fn write_outputs(
        &self,
        points: &mut PointCollection<File>,
        out: &Path,
        writer: &WritePolicy,
        global: &GlobalArgs,
    ) -> Outcome {
        let place = self.check_outputs(out, writer)?;
        let mut table = place.create_file(TABLE)?;
        table.write_text(&csv_header(&self.study));
        let mut summary = SweepSummary::new(&self.study, self.scene.title(), &self.fingerprint);
        let (mut mapped, mut correlations) = (Vec::new(), RankCorrelations::new(&self.study));
        let is_mapped = self.study.is_mapped();
        let each = |index: usize, outcome: Point| {
            table.write_text(&csv_row(&self.study, index, &outcome));
            warn_of_panic(index, &outcome);
            summary.count_point(&outcome);
            if is_mapped {
                mapped.push(outcome);
            } else {
                correlations.look(&self.study, index, &outcome);
            }
        };
        points.for_each_point(each).map_err(collection_failure)?;
        if !is_mapped {
            summary.add_correlations(&self.study, &correlations);
        }
        let maps = self.study.maps.iter().enumerate().filter(|_| is_mapped);
        let drawn = maps.flat_map(|(at, map)| {
            files::figure_files(&map.slug, &sweep_map::draw_figure(&self.study, &self.scene, &mapped, at))
        });
        let mut others: Vec<(String, Vec<u8>)> = drawn.collect();
        if self.study.has_sheet() {
            others.extend(files::figure_files(SHEET_NAME, &self.sheet_figure(&mapped, &correlations)));
        }
        others.push((SUMMARY.to_owned(), summary.to_json().map_err(Failure::internal)?.into_bytes()));
        place.commit(vec![table], &others)?;
        if !global.quiet {
            print_summary(&self.study, &summary);
            print_line!("written to {}", out.display());
        }
        Ok(CommandOutcome::done_if(summary.has_values()))
    }

    /// The figure with all maps of a study or, if the study is not drawn as maps, with its rank correlations.
    fn sheet_figure(&self, mapped: &[Point], correlations: &RankCorrelations) -> Figure {
        match self.study.is_mapped() {
            true => sweep_sheet::draw_figure(&self.study, &self.scene, mapped),
            false => sweep_sheet::draw_correlations(&self.study, correlations),
        }
    }
}

/// Warns of a point whose run panicked. A panic is a defect of the program and must not be mistaken for a
/// property of the study.
fn warn_of_panic(index: usize, point: &Point) {
    if let Some(ended) = point.ended.as_ref().filter(|ended| ended.reason == MissingReason::Panicked) {
        let (number, why) = (index + 1, &ended.why);
        warn_line!("warning: point {number} of the study: the program failed: {why}; please report it");
    }
}

fn print_summary(study: &Study, summary: &SweepSummary) {
    let counts = |counts: &BTreeMap<&str, usize>| {
        counts.iter().map(|(word, n)| format!("{n} {word}")).collect::<Vec<_>>().join(", ")
    };
    print_line!("{}: {} simulated runs: {}", summary.title, summary.points, counts(&summary.status));
    for axis in &study.axes {
        let [from, to] = [axis.values.first(), axis.values.last()].map(|end| end.copied().unwrap_or(0.0));
        let count = || format!("{} values", axis.values.len());
        let values = study.sample.as_ref().map_or_else(count, |_| "sampled".to_owned());
        print_line!("over {}: {values} from {from} to {to}", axis.parameter.name);
    }
    print_line!("map                             values         least      greatest  without a value");
    for map in &summary.maps {
        let end = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.6}"));
        let (least, greatest, missing) = (end(map.least), end(map.greatest), counts(&map.missing));
        print_line!("{:<28} {:>9} {least:>13} {greatest:>13}  {missing}", map.column, map.values);
    }
}
