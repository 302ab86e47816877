//! Slurm: `sbatch` (<https://slurm.schedmd.com/sbatch.html>).
//!
//! `--signal=B:` names the process of the script itself, which is the program; without `B:` only steps of
//! `srun` would get the signal. After the loss of a node a task is queued again and goes on.

use super::plan::Plan;
use super::script::{
    ARRAY_SH, COLLECT_SH, Own, SUBMIT_SH, Scripts, array, clock, collect, directives, submit,
};

const COMMANDS: &str = r#"array=$(sbatch --parsable ../submit/array.sh)
array=${array%%;*}
echo "array: $array"
collect=$(sbatch --parsable --dependency="afterany:$array" ../submit/collect.sh)
echo "collect: ${collect%%;*}"
"#;

pub fn scripts(plan: &Plan) -> Scripts {
    let own = Own {
        before: "",
        shard: "${SLURM_ARRAY_TASK_ID}",
        cores: &format!("${{SLURM_CPUS_PER_TASK:-{}}}", plan.threads),
    };
    let tasks = options(
        plan,
        [format!("--job-name={}", plan.work.name()), format!("--array={}", plan.tasks)],
        plan.threads,
        "%x-%A_%a.log",
    );
    let last = options(plan, ["--job-name=wl-collect".to_owned()], 1, "%x-%j.log");
    let texts = vec![
        (ARRAY_SH, array(plan, &tasks, &own)),
        (COLLECT_SH, collect(plan, &last)),
        (SUBMIT_SH, submit(plan, COMMANDS)),
    ];
    Scripts { program: "sbatch", texts }
}

fn options(plan: &Plan, first: impl IntoIterator<Item = String>, cores: usize, log: &str) -> String {
    let mut lines: Vec<String> = first.into_iter().collect();
    lines.extend(["--nodes=1", "--ntasks=1"].map(str::to_owned));
    lines.push(format!("--cpus-per-task={cores}"));
    if let Some(walltime) = plan.walltime {
        lines.push(format!("--time={}", clock(walltime)));
    }
    lines.extend(["--signal=B:TERM@30", "--requeue", "--open-mode=append"].map(str::to_owned));
    lines.push(format!("--output={log}"));
    directives("#SBATCH", &lines, plan)
}
