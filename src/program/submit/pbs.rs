//! PBS Professional and OpenPBS: `qsub` (its manual page, qsub(1B)).
//!
//! An array is a range of at least two, so that a task takes its number from a list in the script, and one
//! task alone is no array. Output without a path goes where `qsub` was run; arrays can always be run again.

use super::plan::Plan;
use super::script::{
    ARRAY_SH, COLLECT_SH, Own, SUBMIT_SH, Scripts, array, clock, collect, directives, listed, submit,
};

const COMMANDS: &str = r#"array=$(qsub ../submit/array.sh)
echo "array: $array"
collect=$(qsub -W "depend=afterany:$array" ../submit/collect.sh)
echo "collect: $collect"
"#;

pub fn scripts(plan: &Plan) -> Scripts {
    let only = plan.tasks.only().map(|task| task.to_string());
    let (before, shard) = match &only {
        Some(task) => (String::new(), task.as_str()),
        None if plan.tasks.count_from_zero() => (String::new(), "${PBS_ARRAY_INDEX}"),
        None => (listed(plan, "\"$PBS_ARRAY_INDEX\""), "$1"),
    };
    let cores = format!("${{NCPUS:-${{OMP_NUM_THREADS:-${{PBS_NUM_PPN:-{}}}}}}}", plan.threads);
    let own = Own { before: &before, shard, cores: &cores };
    let range = only.is_none().then(|| format!("-J 0-{}", plan.tasks.len() - 1));
    let tasks = options(plan, &plan.work.name(), range, plan.threads);
    let last = options(plan, "wl-collect", None, 1);
    let texts = vec![
        (ARRAY_SH, array(plan, &tasks, &own)),
        (COLLECT_SH, collect(plan, &last)),
        (SUBMIT_SH, submit(plan, COMMANDS)),
    ];
    Scripts { program: "qsub", texts }
}

fn options(plan: &Plan, name: &str, range: Option<String>, cores: usize) -> String {
    let mut lines = vec![format!("-N {name}"), "-S /bin/sh".to_owned()];
    lines.extend(range);
    lines.push(format!("-l select=1:ncpus={cores}"));
    lines.extend(plan.walltime.map(|walltime| format!("-l walltime={}", clock(walltime))));
    lines.extend(["-j oe", "-r y"].map(str::to_owned));
    directives("#PBS", &lines, plan)
}
