//! HTCondor: `condor_submit_dag` (<https://htcondor.readthedocs.io/en/latest/automated-workflows/>).
//!
//! Every task is a node of its own: where one fails the others go on, and the FINAL node runs in any case.
//! Paths are relative to the folder in which `condor_submit_dag` is run. HTCondor has no walltime; a task
//! ends by itself.

use super::plan::Plan;
use super::script::{ARRAY_SH, COLLECT_SH, Own, SUBMIT_SH, Scripts, array, collect, submit};

const DAG: &str = "study.dag";

const COMMANDS: &str = r#"cd ../submit
dag=$(condor_submit_dag -force study.dag)
dag=$(printf '%s\n' "$dag" | sed -n 's/.*submitted to cluster \([0-9][0-9]*\).*/\1/p')
[ -n "$dag" ] || { echo 'condor_submit_dag named no job' >&2; exit 1; }
echo "dag: $dag"
"#;

pub fn scripts(plan: &Plan) -> Scripts {
    let cores = format!("${{2:-{}}}", plan.threads);
    let own = Own { before: "", shard: "$1", cores: &cores };
    let name = plan.work.name();
    let texts = vec![
        (ARRAY_SH, array(plan, "", &own)),
        (COLLECT_SH, collect(plan, "")),
        (
            "array.sub",
            description(plan, "array.sh $(shard) $(request_cpus)", plan.threads, &format!("{name}.$(shard)")),
        ),
        ("collect.sub", description(plan, COLLECT_SH, 1, "wl-collect")),
        (DAG, dag(plan)),
        (SUBMIT_SH, submit(plan, COMMANDS)),
    ];
    Scripts { program: "condor_submit_dag", texts }
}

fn dag(plan: &Plan) -> String {
    let node = |task: usize| format!("JOB shard{task} array.sub\nVARS shard{task} shard=\"{task}\"\n");
    let nodes: String = plan.tasks.iter().map(node).collect();
    format!("# Made by `wiperlab submit`.\n{nodes}FINAL collect collect.sub\n")
}

fn description(plan: &Plan, arguments: &str, cores: usize, log: &str) -> String {
    let own: String = plan.directives.iter().map(|line| format!("{line}\n")).collect();
    format!(
        "# Made by `wiperlab submit`.\nuniverse = vanilla\nexecutable = /bin/sh\ntransfer_executable = false\n\
         arguments = \"{arguments}\"\nrequest_cpus = {cores}\nshould_transfer_files = NO\n\
         output = ../logs/{log}.$(Cluster).out\nerror = ../logs/{log}.$(Cluster).err\n{own}queue\n"
    )
}
