//! Policies that act, fall silent, go on after a fault, and recover the robot.

use crate::harness::{distance, notes, numbers, policy, positions, robot_or_skip, run, setup, text};

#[test]
fn a_policy_drives_and_its_loss_is_a_fault_that_relaxes() {
    let (_robot, _lock) = robot_or_skip!();
    let folder = tempfile::tempdir().unwrap();
    // Nineteen answers, then silence.
    let lost = policy(&folder, "lost", "if n == 20: time.sleep(3.0); break\nact(0.1, 0, 0, 0, 0, 0, -1)");
    let (output, log) = run(&folder, &["--policy", &lost]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output).contains("no action for 0.25"), "{}", text(&output));
    assert!(!text(&output).contains("eflex"));
    let x = numbers(&log, "position_x_m");
    assert!(x[x.len() - 1] - x[0] > 0.01, "it has moved");
    assert_eq!(log["status"].last().unwrap(), "fault");

    for (name, answer, told) in [
        ("other", "act(0, 0, 0)", "answers with 3 numbers, actions of `aforce-force` have 7"),
        ("words", "print('hello', flush=True)", "the policy answers \"hello\"; {\"action\": [..]}"),
        ("none", "break", "the policy ended without an answer"),
    ] {
        let (output, log) = run(&folder, &["--policy", &policy(&folder, name, answer)]);
        assert_eq!(output.status.code(), Some(1));
        assert!(text(&output).contains(told), "{}", text(&output));
        assert!(log.is_empty(), "refused before a torque flows");
    }
}

/// An episode that ends with a fault, two that the policy ends itself, and a pause of a second before each, as a learner needs for an update.
#[test]
fn a_policy_goes_on_after_a_fault_resets_the_arm_and_moves_the_gripper() {
    let (_robot, _lock) = robot_or_skip!("--object", "0.03");
    let folder = tempfile::tempdir().unwrap();
    let setup = setup(&folder, "[robot.gripper]\nspeed = 0.05");
    let lines = "status, episode, gripper = told['status'], told['episode'], told['gripper']
print(episode, status, told.get('reason', ''), gripper['grasped'], round(gripper['width'], 4), file=notes)
if status == 'ready': time.sleep(1.0); steps = 0
if status not in ('ready', 'running', 'limited'): assert told['fault'] == 10; ask('reset'); continue
assert status == 'ready' or abs(told['time'] - 0.05 * steps) < 0.5, told['time']
steps += 1
if steps < 12: act(0.3, 0, 0, 0, 0, 0, -1, 1 if episode == 2 else -1)
elif episode == 1: time.sleep(3.0); act(0, 0, 0, 0, 0, 0, -1, 0)
elif episode == 2: ask('reset')
else: ask('end'); sys.stdin.read(); time.sleep(1.0); print('saved', file=notes)";
    let (output, log) = run(&folder, &["--setup", &setup, "--policy", &policy(&folder, "learner", lines)]);
    let notes = notes(&folder, "learner");
    println!("{notes}");
    assert!(output.status.success());
    let told = |line: &str| notes.lines().filter(|note| note.starts_with(line)).count();
    assert_eq!((told("1 ready"), told("1 fault no action for 0.25"), told("2 ready"), told("3 ready")), (1, 1, 1, 1));
    assert!(told("1 running  False 0.08") + told("1 limited  False 0.08") > 5);
    assert!(told("2 running  True 0.03") + told("2 limited  True 0.03") > 5, "it holds what is 3 cm wide");
    let last: Vec<_> = notes.lines().rev().take(2).collect();
    assert!(last[1].ends_with("False 0.08"), "and lets go: {last:?}");
    assert_eq!(last[0], "saved", "a program that ends may take its time");

    let (at, episodes) = (positions(&log), numbers(&log, "episode"));
    let begin = |episode: f64| episodes.iter().position(|&of| of == episode).unwrap();
    for episode in [2.0, 3.0] {
        let (first, last) = (at[begin(episode)], at[begin(episode) - 1]);
        assert!(distance(at[0], first) < 0.005, "episode {episode} begins at {first:?}, the first at {:?}", at[0]);
        assert!(distance(first, last) > 0.02, "and the one before has moved");
    }
    let width = numbers(&log, "gripper_width_m");
    assert!((width[begin(3.0) - 1] - 0.03).abs() < 1e-4 && log["gripper_grasped"][begin(3.0) - 1] == "1");
}

/// Thirty commands in a row are lost once: the robot stops by itself.
#[test]
fn a_policy_recovers_a_robot_that_has_stopped() {
    let (_robot, _lock) = robot_or_skip!("--gap", "600");
    let folder = tempfile::tempdir().unwrap();
    let lines = "status = told['status']
if n == 1 or status not in ('running', 'limited'): print(told['episode'], status, told.get('reason', ''), file=notes)
if status == 'reflex': ask('recover' if 'recover comes before' in told['reason'] else 'reset')
elif status == 'recovered': ask('reset')
elif told['episode'] == 2 and told['time'] > 0.5: ask('end')
else: act(0.1, 0, 0, 0, 0, 0, -1)";
    let (output, log) = run(&folder, &["--policy", &policy(&folder, "patient", lines)]);
    let notes = notes(&folder, "patient");
    println!("{notes}");
    assert!(output.status.success());
    let told: Vec<_> = notes.lines().filter(|line| line.starts_with(['1', '2'])).collect();
    assert_eq!(told.len(), 5, "{told:?}");
    for (told, expected) in told.iter().zip(["1 ready", "1 reflex ", "1 reflex ", "1 recovered", "2 ready"]) {
        assert!(told.starts_with(expected), "{told}");
    }
    assert!(told[1].contains("communication_constraints_violation"), "{}", told[1]);
    assert!(told[2].contains("recover comes before reset"), "{}", told[2]);
    let (at, episodes) = (positions(&log), numbers(&log, "episode"));
    let begin = episodes.iter().position(|&of| of == 2.0).unwrap();
    assert!(distance(at[0], at[begin]) < 0.005);
}
