//! A small arm as a URDF, for tests that change one thing in it.
#![allow(dead_code)] // Each test uses a part.

use std::fmt::Write;

const AXES: [&str; 7] = ["0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1"];
const ORIGINS: [&str; 7] = ["0 0 0.3", "0 0 0", "0 0 0.3", "0.08 0 0", "-0.08 0 0.35", "0 0 0", "0.09 0 0.1"];
const LIMIT: &str = "lower=\"-2.8\" upper=\"2.8\" effort=\"80\" velocity=\"2\"";

/// The `inertial` element of every link.
pub const INERTIAL: &str = "<inertial><origin xyz=\"0.01 0.02 0.05\"/><mass value=\"2\"/><inertia ixx=\"0.02\" ixy=\"0.001\" \
                            ixz=\"-0.002\" iyy=\"0.03\" iyz=\"0.0005\" izz=\"0.015\"/></inertial>";

/// `joints` joints, j1 and so on, each moving a link, l1 and so on, between `base` and `tool`.
pub fn arm(joints: usize) -> String {
    let mut text = format!("<robot name=\"small\"><link name=\"base\">{INERTIAL}</link>\n");
    let mut parent = "base".to_string();
    for i in 0..joints {
        let (joint, link) = (format!("j{}", i + 1), format!("l{}", i + 1));
        writeln!(
            text,
            "<link name=\"{link}\">{INERTIAL}</link><joint name=\"{joint}\" type=\"revolute\"><parent link=\"{parent}\"/>\
             <child link=\"{link}\"/><origin xyz=\"{}\"/><axis xyz=\"{}\"/><limit {LIMIT}/></joint>",
            ORIGINS[i], AXES[i]
        )
        .unwrap();
        parent = link;
    }
    let fixed = format!("<parent link=\"{parent}\"/><child link=\"tool\"/><origin xyz=\"0 0 0.1\" rpy=\"0 0 0.5\"/>");
    text + &format!("<link name=\"tool\"/><joint name=\"jt\" type=\"fixed\">{fixed}</joint></robot>\n")
}

/// The arm of seven joints, whose last one turns about `axis`.
pub fn with_last_axis(axis: &str) -> String {
    in_line("\"j7\"", "0 0 1", axis)
}

/// The arm of seven joints, one of which has another `limit`.
pub fn limit_of(joint: &str, limit: &str) -> String {
    let limit = if limit.is_empty() { String::new() } else { format!("<limit {limit}/>") };
    in_line(&format!("\"{joint}\""), &format!("<limit {LIMIT}/>"), &limit)
}

/// The arm of seven joints, whose fifth link has this mass (kg), moment about x and about y and z (kg m2).
pub fn inertial_of_l5(mass: &str, x: &str, y: &str) -> String {
    let inertia = format!("<inertia ixx=\"{x}\" ixy=\"0\" ixz=\"0\" iyy=\"{y}\" iyz=\"0\" izz=\"{y}\"/>");
    in_line("<link name=\"l5\"", INERTIAL, &format!("<inertial><mass value=\"{mass}\"/>{inertia}</inertial>"))
}

/// The arm of seven joints with `old` replaced in the line that has `mark`.
fn in_line(mark: &str, old: &str, new: &str) -> String {
    let text = arm(7);
    let line = text.lines().find(|line| line.contains(mark)).unwrap();
    assert!(line.contains(old), "{line}");
    text.replace(line, &line.replace(old, new))
}
