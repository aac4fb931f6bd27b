//! The schedulers: the template of each, how kardan submits a job, and whether the job is still in the queue.

use std::path::Path;
use std::process::{Command, Stdio};

use kardan::diagnostics::Diagnostic;

use crate::args::Target;
use crate::files::reason;

/// The interface to a scheduler.
pub struct Queue {
    pub name: &'static str,
    pub template: &'static str,
    /// How the job is called in the folder.
    pub file: &'static str,
    /// Programs that must be installed.
    pub needs: &'static [&'static str],
    /// How to get them.
    pub install: &'static str,
    /// Command that submits the file appended to it; empty: the job is a script that runs until all shards have ended.
    pub submit: &'static [&'static str],
    /// Command that ends the job whose number is appended to it.
    pub cancel: &'static str,
    /// Whether it reruns a failed shard by itself, as often as `{{retries}}`.
    pub retries_itself: bool,
}

/// In the order of [`Target`].
static QUEUES: [Queue; 5] = [
    Queue {
        name: "slurm",
        template: include_str!("templates/slurm.sh"),
        file: "job.sh",
        needs: &["sbatch", "squeue"],
        install: "Slurm's commands (Debian: apt-get install slurm-client, with the slurm.conf of the cluster)",
        submit: &["sbatch", "--parsable"],
        cancel: "scancel",
        retries_itself: false,
    },
    Queue {
        name: "hyperqueue",
        template: include_str!("templates/hyperqueue.sh"),
        file: "job.sh",
        needs: &["hq"],
        install: "HyperQueue's command `hq` (https://github.com/It4innovations/hyperqueue/releases), and start `hq server start` and `hq worker start`",
        submit: &["hq", "--output-mode", "quiet", "submit"],
        cancel: "hq job cancel",
        retries_itself: false,
    },
    Queue {
        name: "kubernetes",
        template: include_str!("templates/kubernetes.yaml"),
        file: "job.yaml",
        needs: &["kubectl"],
        install: "kubectl (https://kubernetes.io/docs/tasks/tools) with access to a cluster of version 1.29 or newer",
        submit: &["kubectl", "create", "-o", "name", "-f"],
        cancel: "kubectl delete",
        retries_itself: true,
    },
    Queue {
        name: "mpi",
        template: include_str!("templates/mpi.sh"),
        file: "job.sh",
        needs: &["mpirun"],
        install: "an MPI (Debian: apt-get install openmpi-bin)",
        submit: &[],
        cancel: "",
        retries_itself: false,
    },
    Queue {
        name: "local",
        template: include_str!("templates/local.sh"),
        file: "job.sh",
        needs: &["sh", "xargs"],
        install: "a POSIX shell and xargs (Debian: apt-get install findutils)",
        submit: &[],
        cancel: "",
        retries_itself: false,
    },
];

impl Queue {
    pub fn of(target: Target) -> &'static Self {
        &QUEUES[target as usize]
    }

    /// A required program that is missing; a custom script requires the programs that it names.
    pub fn missing(&self, script: &str) -> Option<&'static str> {
        let needed = |program: &&&str| !self.submit.is_empty() || **program == "sh" || script.contains(**program);
        self.needs.iter().filter(needed).find(|program| !exists(program)).copied()
    }

    /// The command to submit by hand.
    pub fn by_hand(&self, file: &str) -> String {
        match self.submit {
            [] => format!("sh {file}"),
            command => format!("{} {file}", command.join(" ")),
        }
    }

    /// Submits the job, and gives its number in the queue.
    pub fn submit(&self, file: &Path) -> Result<String, Diagnostic> {
        let shown = file.display();
        let refused = |why: String| {
            let message = format!("`{}` rejected `{shown}`: {why}", self.submit.join(" "));
            Diagnostic::error("sweep::submit", message)
                .help("fix this and repeat the command with `--resume`; `--template` changes the job")
        };
        let mut command: Vec<&str> = self.submit.to_vec();
        let file = file.to_string_lossy();
        command.push(&file);
        let reply = output_of(&command).map_err(refused)?;
        // `41;cluster` of Slurm.
        let number = reply.lines().last().unwrap_or_default().split(';').next().unwrap_or_default().trim();
        match number.is_empty() || number.contains(char::is_whitespace) {
            true => Err(refused(format!("it answers `{}`, which is not a job number", reply.trim()))),
            false => Ok(number.into()),
        }
    }

    /// Whether a job is still in the queue, or why that is not known.
    pub fn contains(&self, job: &str) -> Result<bool, String> {
        match self.name {
            // Among the jobs of the user, since a query by the number of an ended job would fail.
            "slurm" => {
                Ok(output_of(&["squeue", "--me", "--noheader", "--format=%F"])?.lines().any(|line| line.trim() == job))
            }
            "hyperqueue" => Ok(output_of(&["hq", "--output-mode", "quiet", "job", "list"])?.lines().any(|line| {
                let mut fields = line.split_whitespace();
                fields.next() == Some(job) && matches!(fields.next(), Some("WAITING" | "RUNNING"))
            })),
            _ => {
                let path = "-o=jsonpath={.metadata.name} {.status.conditions[?(@.status==\"True\")].type}";
                let reply = output_of(&["kubectl", "get", job, "--ignore-not-found", path])?;
                let mut fields = reply.split_whitespace();
                Ok(fields.next().is_some() && !fields.any(|word| word == "Complete" || word == "Failed"))
            }
        }
    }
}

/// The output of a program, or its error message if it fails.
fn output_of(command: &[&str]) -> Result<String, String> {
    let output =
        Command::new(command[0]).args(&command[1..]).stdin(Stdio::null()).output().map_err(|error| reason(&error))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    if output.status.success() {
        return Ok(text(&output.stdout));
    }
    let errors = text(&output.stderr);
    // The first lines explain the error; some programs add the location in their code.
    let lines: Vec<&str> = errors.lines().map(str::trim).filter(|line| !line.is_empty()).take(4).collect();
    Err(if lines.is_empty() { format!("it ends with {}", output.status) } else { lines.join("; ") })
}

/// Whether a program is on the PATH.
fn exists(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| {
        [program.to_owned(), format!("{program}{}", std::env::consts::EXE_SUFFIX)]
            .iter()
            .any(|name| folder.join(name).is_file())
    })
}
