//! What is refused before a torque flows.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener};
use std::process::Command;

use crate::harness::{host, robot_or_skip, run, text};

#[test]
fn a_start_outside_of_the_workspace_and_another_arm_are_refused() {
    let (_robot, _lock) = robot_or_skip!();
    let folder = tempfile::tempdir().unwrap();
    let setup = folder.path().join("far.toml");
    let fr3 = include_str!("../../configs/fr3.toml");
    let far = fr3.replace("[[0.25, -0.4, 0.02], [0.7, 0.4, 0.8]]", "[[0.65, -0.4, 0.02], [0.7, 0.4, 0.8]]");
    assert_ne!(far, fr3);
    std::fs::write(&setup, far).unwrap();
    let (output, log) = run(&folder, &["--script", "hold", "--setup", setup.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output).contains("allowed: 0.6000 to 0.7500: refused"), "{}", text(&output));
    assert!(log.is_empty());

    std::fs::write(&setup, fr3.replace("[limits]", "[limits]\nexternal_max = [100, 20]")).unwrap();
    let (output, _) = run(&folder, &["--script", "hold", "--setup", setup.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output).contains("limits.external_max has 100 N: below 100 would be right"), "{}", text(&output));

    std::fs::write(&setup, fr3.replace("arm = \"fr3\"", "arm = \"panda\"")).unwrap();
    let (output, _) = run(&folder, &["--script", "hold", "--setup", setup.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output).contains("arm.range (joint 1, lower end) = -2.8973 is not allowed; allowed: -2.7437 to"));
    assert!(text(&output).contains("the robot is of the kind fr3"));
}

/// A Franka compensates gravity, but not Coriolis forces. A law that compensates gravity too would throw the arm upwards.
#[test]
fn an_interface_that_is_no_frankas_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let setup = folder.path().join("other.toml");
    let fr3 = include_str!("../../configs/fr3.toml");
    for (interface, told) in [
        (
            "{ extends = \"plain\", wrench.observed.cutoff_hz = 25 }",
            "interface.gravity is \"law\": a Franka compensates gravity itself",
        ),
        (
            "{ extends = \"franka\", coriolis = \"arm\" }",
            "interface.coriolis is \"arm\": a Franka leaves Coriolis forces",
        ),
        (
            "{ extends = \"franka\", wrench_sign = \"on-tool\" }",
            "interface.wrench_sign is \"on-tool\": a Franka reports what the tool exerts, \"on-environment\" would be right",
        ),
        (
            "{ extends = \"franka\", wrench_axes = \"tool\" }",
            "interface.wrench_axes is \"tool\": a Franka reports the wrench in the axes of its base",
        ),
        (
            "{ extends = \"franka\", wrench_point = [0, 0, -0.1] }",
            "interface.wrench_point is [0.0, 0.0, -0.1]: franka-host has the moment reported about the tool point, [0.0, 0.0, 0.0]",
        ),
    ] {
        std::fs::write(&setup, fr3.replace("\"franka\"", interface)).unwrap();
        let output = host(&["--script", "hold", "--setup", setup.to_str().unwrap()]).output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert!(text(&output).contains(told), "{}", text(&output));
    }
}

#[test]
fn a_table_that_is_not_below_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let setup = folder.path().join("wall.toml");
    let fr3 = include_str!("../../configs/fr3.toml");
    let refusal = |axis: &str, arguments: &[&str]| {
        std::fs::write(&setup, fr3.replace("[0.0, 0.0, 1.0] # the table is below", axis)).unwrap();
        // No robot listens at this address: a set-up that is not refused fails to connect.
        let mut command = Command::new(env!("CARGO_BIN_EXE_franka-host"));
        command.args(["--robot", "127.0.0.1:9", "--no-realtime", "--setup"]).arg(&setup).args(arguments);
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        text(&output)
    };
    let rehearsal = ["--script", "hold", "--rehearse-table", "0.3"];
    for (option, arguments) in [("--script wipe", &["--script", "wipe"][..]), ("--rehearse-table", &rehearsal)] {
        for (axis, told) in [("[-1, 0, 0]", "[-1.0, 0.0, 0.0]"), ("[0, 0, -1]", "[0.0, 0.0, -1.0]")] {
            let right = "[0.0, 0.0, 1.0] would be right";
            let expected = format!("error: {option} has its table below: contact_axis is {told}, {right}\n");
            assert_eq!(refusal(axis, arguments), expected);
        }
        assert!(refusal("[0, 0, 2]", arguments).contains("127.0.0.1:9"));
    }
    assert!(refusal("[-1, 0, 0]", &["--script", "circle"]).contains("127.0.0.1:9"));
}

#[test]
fn an_address_without_a_robot_and_another_protocol_are_refused() {
    let output = host(&["--script", "hold", "--robot", "127.0.0.1:9"]).output().unwrap();
    // `host` gives --robot already, and clap refuses the option a second time. Below it is given once.
    assert_eq!(output.status.code(), Some(2));
    let alone = |address: &str| {
        let arguments = ["--robot", address, "--no-realtime", "--script", "hold"];
        Command::new(env!("CARGO_BIN_EXE_franka-host")).args(arguments).output().unwrap()
    };
    let output = alone("127.0.0.1:9");
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output).starts_with("error: --robot 127.0.0.1:9: "), "{}", text(&output));

    // A robot that speaks version 99: header (command, id, size), status 1 (incompatible), version.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let mut request = [0; 16];
            stream.read_exact(&mut request).unwrap();
            let mut answer = request[..8].to_vec();
            answer.extend(15u32.to_le_bytes());
            answer.push(1);
            answer.extend(99u16.to_le_bytes());
            stream.write_all(&answer).unwrap();
            let _ = stream.shutdown(Shutdown::Write);
        }
    });
    let output = alone(&address);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output).contains("server version: 99"), "{}", text(&output));
}
