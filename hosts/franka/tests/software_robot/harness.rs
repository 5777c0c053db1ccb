//! The robot in software, the program that drives it, and what the tests read of its log.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// Locked while a robot runs: clients use one fixed port, so that only one robot can run at a time.
pub static PORT: Mutex<()> = Mutex::new(());

/// If this variable is set, as `make test-franka` sets it, a test without a robot fails instead of being skipped.
const REQUIRE: &str = "REQUIRE_SOFTWARE_ROBOT";

/// Writes to standard error, which the capture of the test's output does not hide, why the test is skipped.
fn skip(why: &str) {
    assert!(std::env::var_os(REQUIRE).is_none(), "{why}, and {REQUIRE} is set");
    let _ = writeln!(std::io::stderr(), "SKIPPED: {why}");
}

/// The robot's process. It ends when its standard input closes, so with this process at the latest.
pub struct Robot {
    process: Child,
    /// Seconds of simulated time in which a client was connected.
    seconds: Arc<AtomicU32>,
}

impl Robot {
    /// Starts the robot; `None`, with a message, if it cannot be installed. `faults` are options of the script.
    pub fn start(faults: &[&str]) -> Option<Self> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/software_robot.py");
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("software-robot");
        let python = std::env::var_os("PYTHON").unwrap_or("python3".into());
        let started = Command::new(python)
            .arg(script)
            .arg(folder)
            .args(faults)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let mut child = match started {
            Ok(child) => child,
            Err(error) => {
                skip(&format!("no Python: {error}"));
                return None;
            }
        };
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let line = lines.next().map_or(String::new(), Result::unwrap);
        if line == "ready" {
            let seconds = Arc::new(AtomicU32::new(0));
            let counted = Arc::clone(&seconds);
            std::thread::spawn(move || {
                lines.for_each(|_| {
                    counted.fetch_add(1, Ordering::Relaxed);
                });
            });
            return Some(Self { process: child, seconds });
        }
        let code = child.wait().unwrap().code();
        assert_eq!(code, Some(77), "the software robot did not start: {line}");
        skip("franka-sim cannot be installed");
        None
    }

    /// Waits until between one and two seconds of simulated time have passed.
    pub fn wait(&self) {
        let (from, begin) = (self.seconds.load(Ordering::Relaxed), Instant::now());
        while self.seconds.load(Ordering::Relaxed) < from + 2 {
            assert!(begin.elapsed() < Duration::from_secs(120), "its clock stands");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A robot in software on the fixed port, and the lock that keeps other tests off it as long as the robot lives.
macro_rules! robot_or_skip {
    ($($fault:literal),*) => {{
        let lock = crate::harness::PORT.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        match crate::harness::Robot::start(&[$($fault),*]) {
            Some(robot) => (robot, lock),
            None => return,
        }
    }};
}
pub(crate) use robot_or_skip;

/// The command of `franka-host` on that robot.
pub fn host(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_franka-host"));
    command.args(["--robot", "127.0.0.1", "--no-realtime", "--no-push-check"]);
    // Last, so that a test may append values to the last of these options.
    command.args(arguments);
    command
}

/// Standard output of the program, then its standard error.
pub fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// Columns of a log by name.
pub fn read(log: &Path) -> HashMap<String, Vec<String>> {
    let mut table = csv::Reader::from_path(log).unwrap();
    let header: Vec<String> = table.headers().unwrap().iter().map(String::from).collect();
    let mut columns: HashMap<String, Vec<String>> = HashMap::new();
    for row in table.records() {
        for (name, cell) in header.iter().zip(row.unwrap().iter()) {
            columns.entry(name.clone()).or_default().push(cell.to_owned());
        }
    }
    columns
}

/// A column as numbers.
pub fn numbers(columns: &HashMap<String, Vec<String>>, name: &str) -> Vec<f64> {
    columns[name].iter().map(|cell| cell.parse().unwrap()).collect()
}

/// Runs the program to its end. Returns its output and the columns of its log, none if there is no log.
pub fn run(folder: &TempDir, arguments: &[&str]) -> (Output, HashMap<String, Vec<String>>) {
    let log = folder.path().join(format!("{}.csv", std::fs::read_dir(folder.path()).unwrap().count()));
    let output = host(arguments).arg("--log").arg(&log).output().unwrap();
    println!("{arguments:?}: {}", text(&output));
    (output, if log.exists() { read(&log) } else { HashMap::new() })
}

/// The command of a policy in Python, whose `lines` run for each state that the host `told`. What they print to `notes` is read with [`notes`].
pub fn policy(folder: &TempDir, name: &str, lines: &str) -> String {
    let path = folder.path().join(name);
    let lines = lines.replace('\n', "\n    ");
    let program = format!(
        "import json, sys, time
notes = open({notes:?}, 'w', buffering=1)
def act(*entries): print(json.dumps({{'action': entries}}), flush=True)
def ask(what): print(json.dumps({{'ask': what}}), flush=True)
n = 0
for line in sys.stdin:
    told, n = json.loads(line), n + 1
    {lines}
",
        notes = path.with_extension("notes")
    );
    std::fs::write(&path, program).unwrap();
    format!("python3 {}", path.display())
}

/// The notes of the policy `name`.
pub fn notes(folder: &TempDir, name: &str) -> String {
    std::fs::read_to_string(folder.path().join(name).with_extension("notes")).unwrap()
}

/// Path of the default set-up with `lines` added.
pub fn setup(folder: &TempDir, lines: &str) -> String {
    let path = folder.path().join("setup.toml");
    std::fs::write(&path, format!("{}\n{lines}\n", include_str!("../../configs/fr3.toml"))).unwrap();
    path.display().to_string()
}

/// Position of the tool in each row (m).
pub fn positions(log: &HashMap<String, Vec<String>>) -> Vec<[f64; 3]> {
    let [x, y, z] = ["x", "y", "z"].map(|axis| numbers(log, &format!("position_{axis}_m")));
    (0..x.len()).map(|i| [x[i], y[i], z[i]]).collect()
}

/// Distance between two positions (m).
pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
