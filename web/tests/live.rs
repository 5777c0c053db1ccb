//! The live page's program as the page calls it.

use std::collections::BTreeMap;

use live::policy::Policy;
use live::session::{Hand, Session};
use live::setup::{Setup, knobs};
use serde_json::Value;
use tasks::Env;

fn setup(task: &str, space: &str, player: &str) -> Setup {
    Setup { task: task.into(), space: space.into(), player: player.into(), ..Setup::default() }
}

fn vector(state: &Value, key: &str) -> Vec<f64> {
    state[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// Observations and actions that the program `replay` wrote, with libtorch:
/// `replay --run results/RUN --actions 6 --csv web/reference/TASK.csv`.
#[test]
fn policies_act_as_with_libtorch() {
    for (file, run) in [
        (include_str!("../reference/lift.csv"), "study/table-1/lift/aforce/seed_12"),
        (include_str!("../reference/wipe.csv"), "study/table-1/wipe/variable-force/seed_13"),
    ] {
        let policy = Policy::of(run).unwrap();
        let env = Env::new(policy.env.clone(), 0).unwrap();
        let mut table = csv::Reader::from_reader(file.as_bytes());
        let names = table.headers().unwrap().clone();
        let mut rows = 0;
        for row in table.records() {
            let row = row.unwrap();
            let numbers = |what: &str| -> Vec<f32> {
                let cells = names.iter().zip(&row).filter(|(name, _)| name.starts_with(what));
                cells.map(|(_, cell)| cell.parse().unwrap()).collect()
            };
            let (mut observation, action) = (numbers("Observation, "), numbers("Action, "));
            tasks::scale(env.observation_components(), &mut observation);
            let answer = policy.answer(&observation);
            assert_eq!(answer.len(), action.len());
            for (a, b) in answer.iter().zip(&action) {
                assert!((a - b).abs() < 1e-5, "{run}: {a} with libtorch {b}");
            }
            rows += 1;
        }
        assert_eq!(rows, 6);
    }
}

/// 25 seconds of each kept policy, as the page plays it.
#[test]
fn kept_policies_do_their_tasks() {
    for run in Policy::runs() {
        let policy = Policy::of(run).unwrap();
        let mut session = Session::open(setup(policy.env.task.as_str(), &policy.env.space.name, run)).unwrap();
        session.run(25 * 500);
        assert!(session.state()["fulfilled"].is_number(), "{run}: {}", session.state()["reward"]);
    }
}

#[test]
fn scripts_do_every_task() {
    for (task, space) in [("lift", "aforce"), ("door", "aforce"), ("wipe", "aforce-force"), ("insert", "mid")] {
        let mut session = Session::open(setup(task, space, "script")).unwrap();
        session.run(25 * 500);
        assert!(session.state()["fulfilled"].is_number(), "{task}");
    }
}

/// A constant force moves the tool by as much as the stiffness says.
#[test]
fn a_held_arm_yields_by_its_stiffness() {
    for (space, stiffness) in [("low", 150.0), ("high", 1500.0)] {
        let mut session = Session::open(setup("lift", space, "hold")).unwrap();
        let rest = vector(&session.state(), "tool");
        session.hold(Some(Hand::Force([0.0, 12.0, 0.0]))).unwrap();
        session.run(3000);
        let moved = vector(&session.state(), "tool")[1] - rest[1];
        assert!((moved * stiffness / 12.0 - 1.0).abs() < 0.1, "{space}: {moved} m");
        session.hold(None).unwrap();
        session.run(3000);
        let back = vector(&session.state(), "tool")[1] - rest[1];
        assert!(back.abs() < 0.1 * moved, "{space}: {back} m");
    }
}

/// A ray from the task's camera to the tool meets the hand, and the hand follows the pull.
#[test]
fn what_is_grabbed_follows() {
    let mut session = Session::open(setup("lift", "low", "hold")).unwrap();
    let tool = vector(&session.state(), "tool");
    let eye = [0.62, -0.75, 1.35];
    let above = [tool[0], tool[1], tool[2] + 0.06];
    let found = session.grab(eye, std::array::from_fn(|i| above[i] - eye[i]));
    let (body, at) = (found["body"].as_u64().unwrap() as usize, vector(&found, "at"));
    let point = vector(&found, "point").try_into().unwrap();
    session.hold(Some(Hand::Pull { body, point, to: [at[0], at[1] + 0.1, at[2]] })).unwrap();
    session.run(1000);
    assert!(vector(&session.state(), "tool")[1] - tool[1] > 0.02);
    assert!(session.grab([0.0, 0.0, 5.0], [0.0, 0.0, 1.0]).is_null(), "the sky");
    assert!(session.hold(Some(Hand::Pull { body: 10_000, point, to: [0.0; 3] })).is_err());
}

#[test]
fn what_cannot_be_is_answered_in_a_sentence() {
    let knob =
        |name: &str, value| Setup { knobs: BTreeMap::from([(name.into(), value)]), ..setup("lift", "high", "script") };
    for (wrong, words) in [
        (setup("juggle", "high", "script"), "There is no task \"juggle\" here. There are lift, door, wipe, insert."),
        (setup("lift", "hgih", "script"), "Unknown action space `hgih`; did you mean `high`?"),
        (
            setup("lift", "high", "study/table-1/lift/aforce/seed_12"),
            "was trained in lift with aforce, and cannot play lift with high.",
        ),
        (setup("lift", "high", "mine"), "There is no policy \"mine\" here."),
        (Setup { friction: 9.0, ..setup("lift", "high", "script") }, "friction = 9 is not between 0 and 3."),
        (Setup { delay: f64::NAN, ..setup("lift", "high", "script") }, "delay = NaN is not between 0 and 0.05."),
        (Setup { table: 0.01, ..setup("lift", "high", "script") }, "table_height_m"),
        (knob("stiffness", 1e6), "stiffness = 1000000 is not between 300 and 7500."),
        (knob("psi", 1.0), "The space high has no \"psi\" to set. It has stiffness."),
    ] {
        let problem = Session::open(wrong.clone()).err().unwrap_or_else(|| panic!("{wrong:?}"));
        assert!(problem.contains(words) && problem.ends_with('.'), "{problem}");
    }
}

/// The value of a slider is the stiffness that acts.
#[test]
fn knobs_turn_the_space() {
    let turned = Setup { knobs: BTreeMap::from([("stiffness".into(), 750.0)]), ..setup("lift", "high", "hold") };
    let mut session = Session::open(turned).unwrap();
    session.run(25);
    assert_eq!(vector(&session.state(), "stiffness"), [750.0; 3]);
    assert_eq!(vector(&session.state(), "rotational_stiffness"), [50.0; 3]);
}

/// No slider stands for a number that the actions of a space command.
#[test]
fn a_number_that_is_commanded_has_no_knob() {
    let names =
        |space: &str| -> Vec<&'static str> { knobs(&space.parse().unwrap()).iter().map(|knob| knob.name).collect() };
    assert_eq!(names("aforce"), ["k_min", "k_max", "beta", "alpha"]);
    assert_eq!(names("aforce-psi"), ["k_max", "alpha"]);
    assert_eq!(names("variable"), ["stiffness_max"]);
    let with = |name: &str, value| Setup {
        knobs: BTreeMap::from([(name.into(), value)]),
        ..setup("lift", "aforce-psi", "script")
    };
    let refused = Session::open(with("k_min", 400.0)).err().unwrap();
    assert_eq!(refused, "The space aforce-psi has no \"k_min\" to set. It has k_max, alpha.");
    Session::open(with("k_max", 2000.0)).unwrap();
}

/// An arm that is pulled by 12 N all the time becomes stiff without a new start.
#[test]
fn a_stiffness_changes_while_the_arm_is_held() {
    let mut session = Session::open(setup("lift", "low", "hold")).unwrap();
    let rest = vector(&session.state(), "tool")[1];
    session.hold(Some(Hand::Force([0.0, 12.0, 0.0]))).unwrap();
    session.run(3000);
    let soft = vector(&session.state(), "tool")[1] - rest;
    let stiffer =
        Setup { knobs: BTreeMap::from([("stiffness".into(), 600.0)]), delay: 0.004, ..setup("lift", "low", "hold") };
    session.tune(stiffer.clone()).unwrap();
    session.run(3000);
    let state = session.state();
    let stiff = vector(&state, "tool")[1] - rest;
    assert!((soft * 150.0 / 12.0 - 1.0).abs() < 0.1 && (stiff * 600.0 / 12.0 - 1.0).abs() < 0.1, "{soft} {stiff}");
    assert_eq!(vector(&state, "stiffness"), [600.0; 3]);
    assert!(state["time"].as_f64().unwrap() > 11.9, "no new start");
    for wrong in [Setup { friction: 2.0, ..stiffer.clone() }, Setup { delay: 1.0, ..stiffer.clone() }] {
        assert!(session.tune(wrong).is_err());
    }
    assert_eq!(session.scene()["setup"]["delay"], 0.004, "what cannot be leaves what there is");
}

/// An adaptive K moves to new bounds while the torques come late; after that they come in time again.
#[test]
fn bounds_and_delay_change_while_the_law_runs() {
    let mut session = Session::open(setup("lift", "aforce", "hold")).unwrap();
    session.hold(Some(Hand::Force([0.0, 12.0, 0.0]))).unwrap();
    session.run(1000);
    let lowest = |session: &Session| vector(&session.state(), "stiffness").into_iter().fold(f64::INFINITY, f64::min);
    let own = lowest(&session);
    let bound = 3.0 * own;
    let knobs = BTreeMap::from([("k_min".into(), bound)]);
    session.tune(Setup { knobs, delay: 0.01, ..setup("lift", "aforce", "hold") }).unwrap();
    session.run(1000);
    assert!((lowest(&session) - bound).abs() < 1e-6, "{} {bound}", lowest(&session));
    session.tune(setup("lift", "aforce", "hold")).unwrap();
    session.run(4000);
    assert!(lowest(&session) < bound - 1.0 && session.state()["diverged"] == false, "{}", lowest(&session));
}
