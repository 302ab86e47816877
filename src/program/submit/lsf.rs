//! IBM Spectrum LSF: `bsub` (<https://www.ibm.com/docs/en/spectrum-lsf/10.1.0?topic=reference-bsub>).
//!
//! Indices of an array start at 1, and its list has at most 255 characters, so that a task takes its number
//! from a list in the script. `-W` is in minutes.

use super::plan::Plan;
use super::script::{
    ARRAY_SH, COLLECT_SH, Own, SUBMIT_SH, Scripts, array, collect, directives, listed, submit,
};

const COMMANDS: &str = r#"submitted() {
    sed -n 's/^Job <\([0-9][0-9]*\)>.*/\1/p'
}
array=$(bsub < ../submit/array.sh | submitted)
[ -n "$array" ] || { echo 'bsub named no job' >&2; exit 1; }
echo "array: $array"
collect=$(bsub -w "ended($array)" < ../submit/collect.sh | submitted)
[ -n "$collect" ] || { echo 'bsub named no job for collect.sh' >&2; exit 1; }
echo "collect: $collect"
"#;

pub fn scripts(plan: &Plan) -> Scripts {
    let (before, shard) = if plan.tasks.count_from_zero() {
        (String::new(), "$((LSB_JOBINDEX - 1))")
    } else {
        (listed(plan, "$((LSB_JOBINDEX - 1))"), "$1")
    };
    let cores = format!("${{LSB_DJOB_NUMPROC:-{}}}", plan.threads);
    let own = Own { before: &before, shard, cores: &cores };
    let name = format!("-J \"{}[1-{}]\"", plan.work.name(), plan.tasks.len());
    let tasks = options(plan, name, plan.threads, "%J-%I");
    let last = options(plan, "-J wl-collect".to_owned(), 1, "%J");
    let texts = vec![
        (ARRAY_SH, array(plan, &tasks, &own)),
        (COLLECT_SH, collect(plan, &last)),
        (SUBMIT_SH, submit(plan, COMMANDS)),
    ];
    Scripts { program: "bsub", texts }
}

fn options(plan: &Plan, name: String, cores: usize, log: &str) -> String {
    let mut lines = vec![name, format!("-n {cores}"), "-R \"span[hosts=1]\"".to_owned()];
    lines.extend(plan.walltime.map(|walltime| format!("-W {}", walltime.as_secs().div_ceil(60))));
    lines.extend(["-r".to_owned(), format!("-o {log}.log")]);
    directives("#BSUB", &lines, plan)
}
