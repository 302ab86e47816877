//! Scripts for a scheduler: directives, then the command in the folder from which it was submitted.
//!
//! No directive has a path, as every scheduler quotes in its own way: jobs are submitted from the folder of
//! their logs.

use super::plan::Plan;
use super::shell;

/// Submits the other scripts.
pub const SUBMIT_SH: &str = "submit.sh";
pub const ARRAY_SH: &str = "array.sh";
pub const COLLECT_SH: &str = "collect.sh";

/// What a scheduler is given.
#[derive(Debug)]
pub struct Scripts {
    /// The scheduler's program that submits.
    pub program: &'static str,
    /// Files by name; [`SUBMIT_SH`] submits the others.
    pub texts: Vec<(&'static str, String)>,
}

impl Scripts {
    pub fn files(&self) -> Vec<(&'static str, Vec<u8>)> {
        self.texts.iter().map(|(name, text)| (*name, text.clone().into_bytes())).collect()
    }

    /// All of them on standard output.
    pub fn show(&self) {
        for (place, (name, text)) in self.texts.iter().enumerate() {
            if place > 0 {
                print_line!("");
            }
            print_line!("# ---- {name} ----");
            crate::program::output::result(&crate::program::output::lines(text));
        }
    }
}

/// How a task learns what is its own, as words of the shell.
#[derive(Debug)]
pub struct Own<'a> {
    /// Lines before the command.
    pub before: &'a str,
    /// Number of its shard.
    pub shard: &'a str,
    /// Number of its cores.
    pub cores: &'a str,
}

/// A script of a task. The program takes the place of the shell, so that it gets every signal itself.
pub fn array(plan: &Plan, directives: &str, own: &Own) -> String {
    let Own { before, shard, cores } = own;
    let limit =
        plan.time_limit().map_or_else(String::new, |limit| format!(" --time-limit {}s", limit.as_secs()));
    format!(
        "#!/bin/sh\n# One task of {tasks}, of {shards} shards. Made by `wiperlab submit`.\n{directives}\n{before}\
         {start} \\\n    --shard \"{shard}/{shards}\" --threads \"{cores}\"{limit}\n",
        tasks = plan.tasks.len(),
        shards = plan.shards,
        start = start(plan, &plan.task()),
    )
}

/// A script of the job that puts the shards together.
pub fn collect(plan: &Plan, directives: &str) -> String {
    format!(
        "#!/bin/sh\n# Puts the shards together. Made by `wiperlab submit`.\n{directives}\n{}\n",
        start(plan, &plan.collect())
    )
}

fn start(plan: &Plan, command: &[String]) -> String {
    let (folder, program) = (shell::quoted(&plan.folder), shell::quoted(&plan.program));
    format!("cd {folder} || exit 2\nexec {program} {}", shell::line(command))
}

/// A script that submits, from the folder of the logs.
pub fn submit(plan: &Plan, commands: &str) -> String {
    let logs = shell::quoted(&plan.logs().to_string_lossy());
    format!(
        "#!/bin/sh\n# Submits the tasks and the job after them. Made by `wiperlab submit`.\nset -e\nmkdir -p \
         {logs}\ncd {logs}\n{commands}"
    )
}

/// Lines of directives, each with its prefix.
pub fn directives(prefix: &str, lines: &[String], plan: &Plan) -> String {
    lines.iter().chain(&plan.directives).map(|line| format!("{prefix} {line}\n")).collect()
}

/// `HH:MM:SS` with as many hours as it takes.
pub fn clock(time: std::time::Duration) -> String {
    let s = time.as_secs();
    format!("{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}

/// Numbers of the tasks as arguments of the shell, of which `place` is the first wanted; for schedulers whose
/// arrays are ranges.
pub fn listed(plan: &Plan, place: &str) -> String {
    let tasks: Vec<String> = plan.tasks.iter().map(|task| task.to_string()).collect();
    format!("set -- {}\nshift {place}\n", tasks.join(" "))
}
