//! Runs programs side by side, a few at a time.

use std::io::IsTerminal;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use fs_err::OpenOptions;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use output::program;
use rustix::process::{Pid, Signal, getpid, getppid, kill_process, set_parent_process_death_signal};
use signal_hook::consts::SIGCHLD;
use signal_hook::flag;

use crate::run::place::Place;
use crate::run::stop::{self, Stop};

/// A program to run.
pub struct Job {
    /// Its name in messages.
    pub name: String,
    /// What to run.
    pub command: Command,
    /// The file to which its output is appended; the file's folder is made.
    pub log: PathBuf,
}

/// How a job ended.
pub struct Ended {
    /// The job's name.
    pub name: String,
    /// Its exit code, 126 if it could not be started; `None` if a signal killed it.
    pub code: Option<i32>,
    /// Whether SIGKILL ended it, sent by another program or by the pool after the limit. This is no sign of an error in the job.
    pub killed: bool,
    /// Where its output is.
    pub log: PathBuf,
    /// The last error in its output, or else the last line.
    pub words: String,
}

/// How jobs are run.
pub struct Pool<'a> {
    /// Maximum number of jobs at the same time.
    pub parallel: usize,
    /// Time after which a job is asked to stop.
    pub limit: Option<Duration>,
    /// Further time after which the job is killed.
    pub grace: Duration,
    /// The folder in which all jobs work: no job is begun when it is no longer there.
    pub out: &'a Place,
    /// Whether a stop is requested.
    pub stop: &'a Stop,
}

struct Running {
    name: String,
    begun: Instant,
    /// When it was asked to stop because of the limit.
    asked: Option<Instant>,
    child: Child,
    log: PathBuf,
    /// Length of what the log held before (bytes).
    old: usize,
    bar: ProgressBar,
}

/// The code that a shell gives to what cannot be started.
const NOT_STARTED: Option<i32> = Some(126);

/// Last words of a job that was killed after its limit.
pub const TOO_LATE: &str = "was over its limit of time, did not save itself and was killed";

/// Interval at which child processes are checked.
const POLL: Duration = Duration::from_millis(200);

/// Runs all jobs and returns how each ended. If a stop is requested, the running jobs are asked to stop and no other is
/// begun. A job that cannot be started does not stop the others.
pub fn run(jobs: Vec<Job>, pool: &Pool) -> Vec<Ended> {
    let Pool { parallel, stop, .. } = *pool;
    let progress = PoolProgress::new(jobs.len());
    let mut waiting = jobs.into_iter();
    let (mut running, mut ended) = (vec![], vec![]);
    let mut asked = false;
    // A launcher may have set SIGCHLD to be ignored. The system would then remove ended children before their exit code is read.
    let _ = flag::register(SIGCHLD, Arc::default());
    loop {
        while running.len() < parallel && !stop.requested() {
            let Some(job) = waiting.next() else { break };
            let (name, log) = (job.name.clone(), job.log.clone());
            match start(job, pool, &progress) {
                Ok(job) => running.push(job),
                Err(reason) => {
                    let words = format!("{reason:#}");
                    progress.line(&format!("ENDED  {name}  {words}"));
                    ended.push(Ended { name, code: NOT_STARTED, killed: false, log, words });
                }
            }
        }
        if running.is_empty() {
            return ended;
        }
        if stop.requested() && !asked {
            asked = true;
            progress.line("stopping: running jobs save themselves");
            for job in &running {
                job.ask_to_stop();
            }
        }
        std::thread::sleep(POLL);
        for mut job in std::mem::take(&mut running) {
            match job.child.try_wait().expect("a child that nobody else waits for") {
                None => {
                    if let Some(limit) = pool.limit {
                        job.keep_to(limit, pool.grace, &progress);
                    }
                    job.bar.set_message(last_line(&job.log));
                    running.push(job);
                }
                Some(status) => {
                    progress.ended(&job, status.code());
                    let late = status.code().is_none() && job.asked.is_some_and(|asked| asked.elapsed() > pool.grace);
                    let words = match status.signal() {
                        _ if late => TOO_LATE.into(),
                        Some(signal) => format!("killed by signal {signal}"),
                        None => last_words(&job.log, job.old),
                    };
                    let killed = status.signal() == Some(Signal::KILL.as_raw());
                    ended.push(Ended { name: job.name, code: status.code(), killed, log: job.log, words });
                }
            }
        }
    }
}

impl Running {
    /// Asks the job to stop. A job that was suspended with SIGSTOP is continued, so that it can save a checkpoint.
    fn ask_to_stop(&self) {
        for signal in [Signal::TERM, Signal::CONT] {
            // This fails if the job has just ended, which does no harm.
            let _ = kill_process(Pid::from_child(&self.child), signal);
        }
    }

    /// Asks it to stop after the limit, and kills it if it does not.
    fn keep_to(&mut self, limit: Duration, grace: Duration, progress: &PoolProgress) {
        match self.asked {
            None if self.begun.elapsed() > limit => {
                self.asked = Some(Instant::now());
                progress.line(&format!("over its limit of time, saves itself: {}", self.name));
                self.ask_to_stop();
            }
            Some(asked) if asked.elapsed() > grace => {
                // This too fails if the job has just ended.
                let _ = self.child.kill();
            }
            _ => {}
        }
    }
}

fn start(Job { name, mut command, log }: Job, pool: &Pool, progress: &PoolProgress) -> Result<Running> {
    ensure!(
        pool.out.is_there(),
        "not begun: the folder of the experiment was moved or deleted while the sweep was at work"
    );
    if let Some(folder) = log.parent() {
        fs_err::create_dir_all(folder)?;
    }
    let file = OpenOptions::new().create(true).append(true).open(&log)?.into_parts().0;
    let old = file.metadata()?.len() as usize;
    // In a process group of its own, so that Ctrl-C in a terminal reaches it only once, through this process.
    command.stdin(Stdio::null()).stdout(file.try_clone()?).stderr(file).process_group(0);
    die_with_us(&mut command);
    let child = command.spawn().with_context(|| name.clone())?;
    Ok(Running { bar: progress.begun(&name), name, begun: Instant::now(), asked: None, child, log, old })
}

/// Has the system send SIGTERM to the child when this process ends in any way: otherwise the child would go on without a sweep.
fn die_with_us(command: &mut Command) {
    let us = getpid();
    let listen = move || {
        set_parent_process_death_signal(Some(Signal::TERM))?;
        // Without a handler the signal would end the child at once, so it is held back until the child has one.
        stop::hold()?;
        // This process may have ended before the child asked for the signal.
        if getppid() == Some(us) { Ok(()) } else { Err(std::io::ErrorKind::BrokenPipe.into()) }
    };
    // SAFETY: between fork and exec only calls that are safe in a signal handler are allowed: these are bare system calls.
    unsafe { command.pre_exec(listen) };
}

/// The last line a job wrote, empty if none.
fn last_line(log: &std::path::Path) -> String {
    let text = fs_err::read_to_string(log).unwrap_or_default();
    text.lines().last().unwrap_or_default().trim().into()
}

/// The last line after the first `old` bytes that tells of an error, or else the last line.
fn last_words(log: &std::path::Path, old: usize) -> String {
    let text = fs_err::read_to_string(log).unwrap_or_default();
    let lines: Vec<&str> = text.get(old..).unwrap_or(&text).lines().collect();
    let error = lines.iter().rev().find(|line| line.starts_with("error:") || line.contains("panicked at"));
    error.or(lines.last()).map_or(String::new(), |line| line.trim().into())
}

/// A bar for all jobs and a line for each that runs; plain lines where there is no terminal.
struct PoolProgress {
    all: MultiProgress,
    total: ProgressBar,
    plain: bool,
}

impl PoolProgress {
    fn new(jobs: usize) -> Self {
        let plain = !std::io::stderr().is_terminal();
        let target = if plain { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(4) };
        let all = MultiProgress::with_draw_target(target);
        let total = all.add(ProgressBar::new(jobs as u64));
        total
            .set_style(ProgressStyle::with_template("{bar:24} {pos}/{len} runs  {elapsed}").expect("a valid template"));
        total.tick();
        PoolProgress { all, total, plain }
    }

    fn begun(&self, name: &str) -> ProgressBar {
        if self.plain {
            program::tell(format_args!("begun  {name}"));
        }
        let bar = self.all.add(ProgressBar::new_spinner());
        bar.set_style(ProgressStyle::with_template("{prefix:24} {wide_msg}").expect("a valid template"));
        bar.set_prefix(name.to_string());
        bar
    }

    fn ended(&self, job: &Running, code: Option<i32>) {
        job.bar.finish_and_clear();
        self.total.inc(1);
        let word = if code == Some(0) { "done  " } else { "ENDED " };
        self.line(&format!("{word} {}  {}", job.name, last_line(&job.log)));
    }

    fn line(&self, text: &str) {
        if self.plain {
            program::tell(text);
        } else {
            // A terminal that was closed is not an error.
            let _ = self.all.println(text);
        }
    }
}
