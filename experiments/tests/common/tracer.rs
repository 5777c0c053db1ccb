//! Runs a program under `ptrace` and has one of its writes fail: the k-th of those system calls that change something
//! below a folder. The program itself is unchanged.

use std::collections::HashSet;
use std::ffi::OsString;
use std::io::{Error, Read, Result, Seek};
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::FileExt;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

use libc::{c_int, c_long, pid_t};

/// The fault at the k-th write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The write fails (EIO), and later ones succeed.
    Once,
    /// The disk is full from this write on: half of it is written, and all that follows fails (ENOSPC). Files can still
    /// be deleted and cut.
    Full,
    /// Half of the write is done, and the process is killed.
    Kill,
}

/// The result of a traced program.
#[derive(Debug)]
pub struct Traced {
    /// Number of writes below the folder.
    pub writes: u64,
    /// How the program ended.
    pub status: ExitStatus,
    /// Its standard error.
    pub stderr: String,
    /// The call that failed, and the file.
    pub failed: Option<String>,
}

/// Which arguments of a call name the file: an open file (argument 0), a path, or a folder and a path in it. With `usize::MAX` for the path
/// the folder's argument is an open file.
#[derive(Clone, Copy)]
enum Target {
    Open,
    Path(usize),
    At(usize, usize),
}

/// Calls that change files: number, name, what they change, and whether a full disk refuses them.
const CALLS: [(c_long, &str, Target, bool); 19] = [
    (libc::SYS_write, "write", Target::Open, true),
    (libc::SYS_pwrite64, "pwrite", Target::Open, true),
    (libc::SYS_writev, "writev", Target::Open, true),
    (libc::SYS_copy_file_range, "copy", Target::At(2, usize::MAX), true),
    (libc::SYS_fsync, "fsync", Target::Open, true),
    (libc::SYS_fdatasync, "fdatasync", Target::Open, true),
    (libc::SYS_ftruncate, "ftruncate", Target::Open, false),
    (libc::SYS_open, "open", Target::Path(0), true),
    (libc::SYS_openat, "openat", Target::At(0, 1), true),
    (libc::SYS_mkdir, "mkdir", Target::Path(0), true),
    (libc::SYS_mkdirat, "mkdirat", Target::At(0, 1), true),
    (libc::SYS_rename, "rename", Target::Path(1), true),
    (libc::SYS_renameat, "renameat", Target::At(2, 3), true),
    (libc::SYS_renameat2, "renameat2", Target::At(2, 3), true),
    (libc::SYS_link, "link", Target::Path(1), true),
    (libc::SYS_linkat, "linkat", Target::At(2, 3), true),
    (libc::SYS_unlink, "unlink", Target::Path(0), false),
    (libc::SYS_unlinkat, "unlinkat", Target::At(0, 1), false),
    (libc::SYS_rmdir, "rmdir", Target::Path(0), false),
];

/// Runs `command`, and the programs that it starts, with a fault at the k-th write (from 1) below `folder`, if one is asked for.
pub fn run(mut command: Command, folder: &Path, fault: Option<(u64, Fault)>) -> Result<Traced> {
    let mut stderr = tempfile::tempfile()?;
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(stderr.try_clone()?);
    let filter = filter();
    // SAFETY: three bare system calls, on memory that the fork has copied.
    unsafe { command.pre_exec(move || be_traced(&filter)) };
    let root = command.spawn()?.id() as pid_t;
    let mut tracer = Tracer { folder, fault, writes: 0, failed: None, full: false };
    let mut known = HashSet::new();
    let mut ended = None;
    loop {
        let mut status = 0;
        // SAFETY: waits for what this thread traces, into a number of its own.
        let pid = unsafe { libc::waitpid(-1, &raw mut status, libc::__WALL | libc::__WNOTHREAD) };
        if pid < 0 {
            break;
        }
        if libc::WIFEXITED(status) || libc::WIFSIGNALED(status) {
            if pid == root {
                ended = Some(ExitStatus::from_raw(status));
            }
            continue;
        }
        let (signal, event) = (libc::WSTOPSIG(status), status >> 16);
        let is_new = known.insert(pid);
        if is_new && pid == root {
            let followed = libc::PTRACE_O_TRACEFORK | libc::PTRACE_O_TRACEVFORK | libc::PTRACE_O_TRACECLONE;
            let options = followed | libc::PTRACE_O_TRACEEXEC | libc::PTRACE_O_TRACESECCOMP | libc::PTRACE_O_EXITKILL;
            request(libc::PTRACE_SETOPTIONS, pid, options as usize)?;
        }
        if event == libc::PTRACE_EVENT_SECCOMP {
            tracer.call(pid)?;
        }
        // A new thread or process begins with a stop of its own, the first program with that of its exec.
        let ours = event != 0 || is_new && [libc::SIGSTOP, libc::SIGTRAP].contains(&signal);
        // This fails if the process was killed meanwhile.
        let _ = request(libc::PTRACE_CONT, pid, if ours { 0 } else { signal as usize });
    }
    let mut text = String::new();
    stderr.rewind()?;
    stderr.read_to_string(&mut text)?;
    let status = ended.ok_or_else(|| Error::other("the program ended unseen"))?;
    Ok(Traced { writes: tracer.writes, status, stderr: text, failed: tracer.failed })
}

struct Tracer<'a> {
    folder: &'a Path,
    fault: Option<(u64, Fault)>,
    writes: u64,
    failed: Option<String>,
    full: bool,
}

impl Tracer<'_> {
    /// Handles a call at which the filter has stopped the process.
    fn call(&mut self, pid: pid_t) -> Result<()> {
        // SAFETY: plain numbers, for which zero is a value; the system fills them.
        let mut registers: libc::user_regs_struct = unsafe { std::mem::zeroed() };
        request(libc::PTRACE_GETREGS, pid, &raw mut registers as usize)?;
        let arguments = [registers.rdi, registers.rsi, registers.rdx, registers.r10];
        let number = registers.orig_rax as c_long;
        let (_, name, target, refused) = CALLS.into_iter().find(|call| call.0 == number).expect("in the filter");
        let flags = match number {
            libc::SYS_open => arguments[1],
            libc::SYS_openat => arguments[2],
            _ => libc::O_CREAT as u64,
        };
        let Some(path) = target.path(pid, &arguments).filter(|path| path.starts_with(self.folder)) else {
            return Ok(());
        };
        if flags as c_int & (libc::O_CREAT | libc::O_TRUNC) == 0 {
            return Ok(());
        }
        self.writes += 1;
        let Some((at, fault)) = self.fault else { return Ok(()) };
        if self.writes == at {
            self.failed = Some(format!("{name} {}", path.display()));
        }
        let is_write = [libc::SYS_write, libc::SYS_pwrite64].contains(&number) && arguments[2] > 1;
        match fault {
            Fault::Once if self.writes == at => fail(pid, registers, libc::EIO),
            Fault::Full if self.full && refused => fail(pid, registers, libc::ENOSPC),
            Fault::Full if self.writes == at => {
                self.full = true;
                if is_write {
                    halve(pid, registers)
                } else if refused {
                    fail(pid, registers, libc::ENOSPC)
                } else {
                    Ok(())
                }
            }
            // The program writes the other half next, and is killed at that call.
            Fault::Kill if self.writes == at && is_write => halve(pid, registers),
            Fault::Kill if self.writes >= at => {
                // SAFETY: a bare system call.
                unsafe { libc::kill(pid, libc::SIGKILL) };
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

/// Has the call return an error without being made.
fn fail(pid: pid_t, mut registers: libc::user_regs_struct, error: c_int) -> Result<()> {
    registers.orig_rax = u64::MAX;
    registers.rax = -i64::from(error) as u64;
    request(libc::PTRACE_SETREGS, pid, &raw mut registers as usize)
}

/// Has the call write half of its bytes.
fn halve(pid: pid_t, mut registers: libc::user_regs_struct) -> Result<()> {
    registers.rdx /= 2;
    request(libc::PTRACE_SETREGS, pid, &raw mut registers as usize)
}

impl Target {
    /// The file that a call is about.
    fn path(self, pid: pid_t, arguments: &[u64; 4]) -> Option<PathBuf> {
        let open = |file: u64| {
            let link = if file as c_int == libc::AT_FDCWD { "cwd".into() } else { format!("fd/{}", file as c_int) };
            std::fs::read_link(format!("/proc/{pid}/{link}")).ok()
        };
        match self {
            Target::Open => open(arguments[0]),
            Target::At(file, usize::MAX) => open(arguments[file]),
            Target::Path(at) => Some(open(libc::AT_FDCWD as u64)?.join(text(pid, arguments[at])?)),
            Target::At(folder, at) => Some(open(arguments[folder])?.join(text(pid, arguments[at])?)),
        }
    }
}

/// The path at an address of a process.
fn text(pid: pid_t, address: u64) -> Option<PathBuf> {
    let memory = std::fs::File::open(format!("/proc/{pid}/mem")).ok()?;
    let mut bytes = vec![];
    let mut byte = [0];
    while memory.read_exact_at(&mut byte, address + bytes.len() as u64).is_ok() && byte[0] != 0 {
        bytes.push(byte[0]);
    }
    Some(OsString::from_vec(bytes).into())
}

fn request(what: libc::c_uint, pid: pid_t, data: usize) -> Result<()> {
    // SAFETY: `data` is a number, or the address of registers that outlive the call.
    let done = unsafe { libc::ptrace(what, pid, 0, data) };
    if done < 0 { Err(Error::last_os_error()) } else { Ok(()) }
}

/// Stops a process at each of [`CALLS`], and lets all others pass.
fn filter() -> Vec<libc::sock_filter> {
    let jump = libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K;
    let statement = |code: u32, k: u32| libc::sock_filter { code: code as u16, jt: 0, jf: 0, k };
    // The first field of what the filter is given is the number of the call.
    let mut filter = vec![statement(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0)];
    for (number, ..) in CALLS {
        filter.push(libc::sock_filter { code: jump as u16, jt: 0, jf: 1, k: number as u32 });
        filter.push(statement(libc::BPF_RET | libc::BPF_K, libc::SECCOMP_RET_TRACE));
    }
    filter.push(statement(libc::BPF_RET | libc::BPF_K, libc::SECCOMP_RET_ALLOW));
    filter
}

/// Prepares the child before it becomes the program.
fn be_traced(filter: &[libc::sock_filter]) -> Result<()> {
    let program = libc::sock_fprog { len: filter.len() as u16, filter: filter.as_ptr().cast_mut() };
    // SAFETY: bare system calls; the program outlives them.
    let done = unsafe {
        libc::ptrace(libc::PTRACE_TRACEME, 0, 0, 0) == 0
            && libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0
            && libc::prctl(libc::PR_SET_SECCOMP, libc::SECCOMP_MODE_FILTER, &raw const program) == 0
    };
    if done { Ok(()) } else { Err(Error::last_os_error()) }
}
