//! Environment, law and kept policies behind four functions, for a page in a browser.
//!
//! The page asks [`room`] for as many bytes as its question in JSON has, and writes the question there. [`ask`] answers and returns the answer's
//! length; [`answer`] says where the answer lies. After a trap [`last_words`] gives the panic's message. No binding generator is needed: the
//! functions take and return only numbers, and the module imports nothing.

pub mod bits;
#[cfg(any(test, not(target_env = "gnu")))]
mod nearest;
pub mod policy;
pub mod session;
pub mod setup;

use std::cell::RefCell;
use std::sync::Mutex;

use aforce::ActionSpace;
use serde::Deserialize;
use serde_json::{Value, json};
use tasks::TaskName;

use crate::policy::Policy;
use crate::session::{Hand, Session};
use crate::setup::Setup;

/// What the page asks for.
#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
enum Question {
    /// What there is to choose from.
    About,
    /// Begins an episode; the answer is the scene.
    Open { setup: Setup },
    /// Changes the space's numbers or the delay while the episode runs.
    Tune { setup: Setup },
    /// Runs so many control samples; the answer is the state after them.
    Run { samples: u32 },
    /// Finds the point that a ray meets (m, world).
    Grab { origin: [f64; 3], direction: [f64; 3] },
    /// Puts a hand on the arm, or takes it off.
    Hold { hand: Option<Hand> },
    /// Digests of so many episodes of every task and action space.
    Bits { episodes: u32 },
}

thread_local! {
    static SESSION: RefCell<Option<Session>> = const { RefCell::new(None) };
    static BUFFER: RefCell<Vec<u8>> = const { RefCell::new(vec![]) };
}

/// Message of the last panic.
static LAST_WORDS: Mutex<String> = Mutex::new(String::new());

/// Makes room for a question of so many bytes. Returns the address at which to write it.
#[unsafe(no_mangle)]
pub extern "C" fn room(bytes: usize) -> *mut u8 {
    BUFFER.with_borrow_mut(|buffer| {
        buffer.resize(bytes, 0);
        buffer.as_mut_ptr()
    })
}

/// Answers the question in the buffer. Returns the length of the answer in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn ask() -> usize {
    std::panic::set_hook(Box::new(|panic| *LAST_WORDS.lock().expect("no panic in a panic") = panic.to_string()));
    let question = BUFFER.take();
    let answer = match serde_json::from_slice(&question).map_err(|problem| problem.to_string()).and_then(respond) {
        Ok(value) => value,
        Err(problem) => json!({"problem": problem}),
    };
    keep(answer.to_string())
}

/// After a trap: makes the panic's message the answer. Returns its length in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn last_words() -> usize {
    keep(LAST_WORDS.lock().map(|words| words.clone()).unwrap_or_default())
}

/// Address of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    BUFFER.with_borrow(|buffer| buffer.as_ptr())
}

fn keep(text: String) -> usize {
    BUFFER.replace(text.into_bytes());
    BUFFER.with_borrow(Vec::len)
}

fn respond(question: Question) -> Result<Value, String> {
    match question {
        Question::About => about(),
        Question::Open { setup } => {
            let session = Session::open(setup)?;
            let scene = session.scene();
            SESSION.set(Some(session));
            Ok(scene)
        }
        Question::Tune { setup } => with_session(|session| session.tune(setup).map(|()| Value::Null)),
        Question::Run { samples } => with_session(|session| {
            session.run(samples);
            Ok(session.state())
        }),
        Question::Grab { origin, direction } => with_session(|session| Ok(session.grab(origin, direction))),
        Question::Hold { hand } => with_session(|session| session.hold(hand).map(|()| Value::Null)),
        Question::Bits { episodes } => Ok(json!(bits::lines(episodes).collect::<Vec<_>>())),
    }
}

fn with_session(answer: impl FnOnce(&mut Session) -> Result<Value, String>) -> Result<Value, String> {
    SESSION.with_borrow_mut(|session| answer(session.as_mut().ok_or("No episode has begun.")?))
}

fn about() -> Result<Value, String> {
    let task = |task: TaskName| json!({"name": task.as_str(), "purpose": task.purpose()});
    let policy = |run: &'static str| {
        let policy = Policy::of(run)?;
        Ok(json!({"run": run, "task": policy.env.task.as_str(), "space": policy.env.space.name}))
    };
    Ok(json!({
        "tasks": TaskName::BUILT_IN.map(task),
        "spaces": ActionSpace::names(),
        "policies": Policy::runs().map(policy).collect::<Result<Vec<_>, String>>()?,
        "setup": Setup::default(),
    }))
}
