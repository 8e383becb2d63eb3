//! A Slurm cluster of one node on loopback, in a temporary folder that is removed at the end.

use super::{Console, Finished, Workspace, execute_with};
use anyhow::{Context, bail};
use std::fs::{self, File};
use std::io::Read;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Longest wait until the node is idle, and until programs end.
const PATIENCE: Duration = Duration::from_secs(30);
/// Interval between two checks.
const LOOK: Duration = Duration::from_millis(200);
/// Smallest number of processors of the node: a task in the document's script needs as many.
const LEAST_CPUS: usize = 2;
/// Number of lines of each log that a failure shows.
const TAIL: usize = 8;

/// Programs of a cluster, with their files.
pub(super) struct Cluster {
    folder: PathBuf,
    /// Programs in the order in which they were started.
    programs: Vec<Child>,
    /// Environment variables of the cluster's clients: its configuration, and `flexor` on the path.
    variables: [(&'static str, String); 2],
}

impl Cluster {
    /// Starts the programs, and waits for the node.
    ///
    /// # Errors
    /// Fails if a program cannot be started or the node does not become idle.
    pub fn start(at: &Workspace, console: &mut Console) -> anyhow::Result<Self> {
        let name = format!("flexor-cluster-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        let path = std::env::var("PATH").unwrap_or_default();
        let own = at.target.join("debug");
        let configuration = folder.join("slurm.conf").display().to_string();
        let mut cluster = Self {
            folder,
            programs: Vec::new(),
            variables: [
                ("SLURM_CONF", configuration.clone()),
                ("PATH", format!("{}:{path}", own.display())),
            ],
        };
        let host = cluster.run(at, console, "uname", &["-n"])?;
        let host = host.lines.first().and_then(|host| host.split('.').next());
        cluster.prepare(host.context("this computer has no host name")?)?;
        let munge = |file: &str| cluster.folder.join("munge").join(file);
        let options = ["key-file", "socket", "pid-file", "log-file", "seed-file"];
        let options = options.map(|text| format!("--{text}={}", munge(text).display()));
        let mut words = vec!["--foreground"];
        words.extend(options.iter().map(String::as_str));
        cluster.start_program("munged", &words)?;
        cluster.start_program("slurmctld", &["-D", "-f", &configuration])?;
        cluster.start_program("slurmd", &["-D", "-f", &configuration])?;
        cluster.await_node(at, console)?;
        Ok(cluster)
    }

    /// Returns the folder for tasks.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Runs a client of the cluster or `flexor`.
    ///
    /// # Errors
    /// Fails if it cannot be started.
    pub fn run(
        &self,
        at: &Workspace,
        console: &mut Console,
        program: &str,
        words: &[&str],
    ) -> anyhow::Result<Finished> {
        let variables = self.variables.iter();
        let variables: Vec<(&str, &str)> = variables.map(|(k, v)| (*k, v.as_str())).collect();
        execute_with(at, console, program, words, &variables)
    }

    /// Returns the end of each program's log.
    pub fn log_tails(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for program in ["munged", "slurmctld", "slurmd"] {
            let log = fs::read(self.log(program)).unwrap_or_default();
            let text = String::from_utf8_lossy(&log).into_owned();
            let written: Vec<&str> = text
                .lines()
                .filter(|line| !line.trim().is_empty())
                .collect();
            let tail = written.iter().skip(written.len().saturating_sub(TAIL));
            lines.extend(tail.map(|line| format!("{program}: {line}")));
        }
        lines
    }

    fn log(&self, program: &str) -> PathBuf {
        self.folder.join(format!("{program}.log"))
    }

    /// Creates folders, the programs' shared key, and the configuration for a machine called
    /// `host`.
    fn prepare(&self, host: &str) -> anyhow::Result<()> {
        let made = |path: &Path| format!("{} cannot be made", path.display());
        for name in ["munge", "state", "spool"] {
            let path = self.folder.join(name);
            fs::create_dir_all(&path).with_context(|| made(&path))?;
        }
        let key = self.folder.join("munge/key-file");
        let mut random = File::open("/dev/urandom").context("/dev/urandom cannot be read")?;
        let mut bytes = [0; 128];
        random.read_exact(&mut bytes)?;
        fs::write(&key, bytes).with_context(|| made(&key))?;
        Command::new("chmod").arg("600").arg(&key).status()?;
        let path = self.folder.join("slurm.conf");
        fs::write(&path, self.configuration(host)?).with_context(|| made(&path))
    }

    /// Returns a configuration of one node, this machine. A requeued job may begin again once its
    /// credential has expired, after 5 s instead of two minutes.
    fn configuration(&self, host: &str) -> anyhow::Result<String> {
        let ports = [free_port()?, free_port()?];
        let cpus = std::thread::available_parallelism().map_or(1, usize::from);
        let cpus = cpus.max(LEAST_CPUS);
        let folder = self.folder.display();
        let [controller, node] = ports;
        Ok(format!(
            "ClusterName=loopback\n\
             SlurmctldHost={host}(127.0.0.1)\n\
             SlurmctldPort={controller}\n\
             SlurmdPort={node}\n\
             SlurmUser=root\n\
             SlurmdUser=root\n\
             AuthType=auth/munge\n\
             AuthInfo=socket={folder}/munge/socket,cred_expire=5\n\
             StateSaveLocation={folder}/state\n\
             SlurmdSpoolDir={folder}/spool\n\
             SlurmctldPidFile={folder}/slurmctld.pid\n\
             SlurmdPidFile={folder}/slurmd.pid\n\
             ProctrackType=proctrack/linuxproc\n\
             TaskPlugin=task/none\n\
             SelectType=select/cons_tres\n\
             SelectTypeParameters=CR_CPU\n\
             SlurmdParameters=config_overrides\n\
             SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0,bf_interval=1\n\
             MpiDefault=none\n\
             SwitchType=switch/none\n\
             ReturnToService=2\n\
             JobRequeue=1\n\
             NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN\n\
             PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP\n"
        ))
    }

    fn start_program(&mut self, program: &str, words: &[&str]) -> anyhow::Result<()> {
        let log = File::create(self.log(program))?;
        let started = Command::new(program)
            .args(words)
            .current_dir(&self.folder)
            .envs(self.variables.iter().map(|(k, v)| (*k, v.as_str())))
            .stdin(Stdio::null())
            .stdout(log.try_clone()?)
            .stderr(log)
            .spawn();
        let started = started.with_context(|| format!("`{program}` cannot be started"))?;
        self.programs.push(started);
        Ok(())
    }

    fn await_node(&mut self, at: &Workspace, console: &mut Console) -> anyhow::Result<()> {
        let begin = Instant::now();
        loop {
            let asked = self.run(at, console, "sinfo", &["-h", "-o", "%T"])?;
            if asked.success && asked.lines == ["idle"] {
                return Ok(());
            }
            if begin.elapsed() > PATIENCE {
                let seen = asked.lines.join("; ");
                bail!(
                    "the Slurm node did not become idle: {seen}\n{}",
                    self.log_tails().join("\n")
                );
            }
            sleep(LOOK);
        }
    }
}

impl Drop for Cluster {
    /// Ends running programs, and removes the folder.
    fn drop(&mut self) {
        let variables = self.variables.iter().map(|(k, v)| (*k, v.as_str()));
        let mut cancel = Command::new("scancel");
        cancel.args(["--user", "root"]).envs(variables.clone());
        let _ = cancel.stdout(Stdio::null()).stderr(Stdio::null()).status();
        let begin = Instant::now();
        let is_busy = || {
            let mut asked = Command::new("squeue");
            asked.arg("-h").envs(variables.clone());
            asked.output().is_ok_and(|output| !output.stdout.is_empty())
        };
        while is_busy() && begin.elapsed() < PATIENCE {
            sleep(LOOK);
        }
        while let Some(mut program) = self.programs.pop() {
            let id = program.id().to_string();
            let _ = Command::new("kill").arg(id).status();
            let begin = Instant::now();
            while matches!(program.try_wait(), Ok(None)) && begin.elapsed() < PATIENCE {
                sleep(LOOK);
            }
            let _ = program.kill(); // it has ended, or cannot be ended
            let _ = program.wait();
        }
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Returns a loopback port that is free at the moment.
fn free_port() -> anyhow::Result<u16> {
    Ok(TcpListener::bind("127.0.0.1:0")?.local_addr()?.port())
}
