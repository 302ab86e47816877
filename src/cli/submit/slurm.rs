//! Slurm: `sbatch` (<https://slurm.schedmd.com/sbatch.html>) accepts a script for the tasks and a script for
//! the job that puts the shards together; a third script submits both.
//!
//! No directive contains a path, which would need quoting: jobs are submitted from the folder of their logs.
//! `--signal=B:` signals the process of the script itself, which is the program; without `B:` only steps of
//! `srun` receive the signal. After the failure of a node, a task is queued again and continues.

use super::plan::SubmissionPlan;
use crate::cli::submit;
use std::time::Duration;

/// The program that submits scripts.
pub(crate) const SBATCH: &str = "sbatch";
/// Name of the script that submits the other scripts.
pub(crate) const SUBMIT_SH: &str = "submit.sh";

const SUBMIT_COMMANDS: &str = r#"array=$(sbatch --parsable ../submit/array.sh)
array=${array%%;*}
echo "array: $array"
collect=$(sbatch --parsable --dependency="afterany:$array" ../submit/collect.sh)
echo "collect: ${collect%%;*}"
"#;

/// All scripts, each with its name.
pub(crate) fn slurm_scripts(plan: &SubmissionPlan) -> [(&'static str, String); 3] {
    [("array.sh", array_script(plan)), ("collect.sh", collect_script(plan)), (SUBMIT_SH, submit_script(plan))]
}

/// Script of a task. The program replaces the shell (`exec`), so that it receives signals directly.
fn array_script(plan: &SubmissionPlan) -> String {
    let own = [format!("--job-name={}", plan.work.job_name()), format!("--array={}", plan.tasks)];
    let limit =
        plan.time_limit().map_or_else(String::new, |limit| format!(" --time-limit {}s", limit.as_secs()));
    format!(
        "#!/bin/sh\n# One task of {tasks}, of {shards} shards. Made by `wiperlab submit`.\n{directives}\n{start} \
         \\\n    --shard \"${{SLURM_ARRAY_TASK_ID}}/{shards}\" --threads \"${{SLURM_CPUS_PER_TASK:-{threads}}}\"\
         {limit}\n",
        tasks = plan.tasks.len(),
        shards = plan.shards,
        directives = directive_lines(plan, &own, plan.threads, "%x-%A_%a.log"),
        start = start_lines(plan, &plan.task_command()),
        threads = plan.threads,
    )
}

/// Script of the job that puts the shards together.
fn collect_script(plan: &SubmissionPlan) -> String {
    format!(
        "#!/bin/sh\n# Puts the shards together. Made by `wiperlab submit`.\n{}\n{}\n",
        directive_lines(plan, &["--job-name=wl-collect".to_owned()], 1, "%x-%j.log"),
        start_lines(plan, &plan.collect_command())
    )
}

/// Script that submits the other scripts from the folder of the logs.
fn submit_script(plan: &SubmissionPlan) -> String {
    let logs = submit::quote_word(&plan.logs_folder().to_string_lossy());
    format!(
        "#!/bin/sh\n# Submits the tasks and the job after them. Made by `wiperlab submit`.\nset -e\nmkdir -p \
         {logs}\ncd {logs}\n{SUBMIT_COMMANDS}"
    )
}

fn start_lines(plan: &SubmissionPlan, command: &[String]) -> String {
    let (folder, program) = (submit::quote_word(&plan.folder), submit::quote_word(&plan.program));
    format!("cd {folder} || exit 2\nexec {program} {}", submit::join_words(command))
}

fn directive_lines(plan: &SubmissionPlan, own: &[String], cores: usize, log: &str) -> String {
    let mut lines = own.to_vec();
    lines.extend(["--nodes=1", "--ntasks=1"].map(str::to_owned));
    lines.push(format!("--cpus-per-task={cores}"));
    lines.extend(plan.walltime.map(|walltime| format!("--time={}", format_clock(walltime))));
    lines.extend(["--signal=B:TERM@30", "--requeue", "--open-mode=append"].map(str::to_owned));
    lines.push(format!("--output={log}"));
    lines.iter().chain(&plan.directives).map(|line| format!("#SBATCH {line}\n")).collect()
}

/// A time as `HH:MM:SS`; the number of hours is not limited.
fn format_clock(time: Duration) -> String {
    let s = time.as_secs();
    format!("{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}
