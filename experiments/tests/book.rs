//! The commands in README and book work. The commands of a page are run in their order, in a folder of their own, with
//! settings that make them cheap. Every TOML block is read by its program.

mod common;

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

use aforce::host::HostSetup;
use common::program;

/// Learner and episodes so small that a run takes a second.
const SMALL: [&str; 6] = [
    "learner.hidden=[8]",
    "learner.batch_size=8",
    "learner.random_steps=100",
    "evaluate_every=200",
    "evaluation_episodes=1",
    "env.horizon=50",
];

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// The words of every command of this workspace on a page, without `cargo run`: the program and its arguments.
fn commands(text: &str) -> Vec<Vec<String>> {
    // A backslash continues a long command on the next line.
    let text = text.replace("\\\n", " ");
    let lines = text.lines().filter_map(|line| line.trim().strip_prefix("cargo run --release --bin "));
    lines.map(|line| line.split_whitespace().filter(|word| *word != "--").map(String::from).collect()).collect()
}

/// The TOML blocks of a page, each with the file name that was mentioned last before it, if any.
fn tables(text: &str) -> Vec<(Option<String>, String)> {
    let mut blocks = vec![];
    let mut before = String::new();
    for (place, part) in text.split("```").enumerate() {
        match part.strip_prefix("toml\n").filter(|_| place % 2 == 1) {
            Some(block) => {
                let named = before.split('`').rfind(|word| word.ends_with(".toml") && !word.contains(['/', ' ']));
                blocks.push((named.map(String::from), block.to_string()));
            }
            None if place % 2 == 0 => before = part.to_string(),
            None => {}
        }
    }
    blocks
}

/// An arm with the links that the book's robot file names.
fn six_joints() -> String {
    let joints = [
        ("shoulder_link", "0 0 0.1625", "0 0 0"),
        ("upper_arm_link", "0 0 0", "1.5708 0 0"),
        ("forearm_link", "-0.425 0 0", "0 0 0"),
        ("wrist_1_link", "-0.3922 0 0.1333", "0 0 0"),
        ("wrist_2_link", "0 -0.0997 0", "1.5708 0 0"),
        ("wrist_3_link", "0 0.0996 0", "1.5708 3.14159 3.14159"),
        ("tool0", "0 0 0", "0 0 0"),
    ];
    let mut parent = "base_link";
    let mut urdf = "<robot name=\"arm\"><link name=\"base_link\"/>".to_string();
    for (link, xyz, rpy) in joints {
        let kind = if link == "tool0" { "fixed" } else { "revolute" };
        let inertial = "<inertial><mass value=\"2\"/><inertia ixx=\"0.02\" iyy=\"0.02\" izz=\"0.02\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";
        let inertial = if link == "tool0" { "" } else { inertial };
        urdf += &format!(
            "<link name=\"{link}\">{inertial}</link>
             <joint name=\"to_{link}\" type=\"{kind}\">
               <parent link=\"{parent}\"/><child link=\"{link}\"/><origin xyz=\"{xyz}\" rpy=\"{rpy}\"/><axis xyz=\"0 0 1\"/>
               <limit lower=\"-3\" upper=\"3\" effort=\"150\" velocity=\"3\"/>
             </joint>"
        );
        parent = link;
    }
    urdf + "</robot>"
}

/// `arguments` for `program`, changed so that the command takes little time.
fn cheap(program: &str, arguments: &[String]) -> Vec<String> {
    let mut cheap = arguments.to_vec();
    let mut set = |flag: &str, value: &str| {
        let place = cheap.iter().position(|word| word == flag);
        match place {
            Some(place) => cheap[place + 1] = value.into(),
            None => cheap.extend([flag.into(), value.into()]),
        }
    };
    match program {
        "train" => {
            set("--steps", "400");
            SMALL.iter().for_each(|small| cheap.extend(["--set".into(), (*small).into()]));
        }
        "evaluate" => set("--episodes", "1"),
        "replay" => {
            set("--actions", "3");
            if ["--png", "--sheet", "--gif"].iter().any(|picture| arguments.iter().any(|word| word == picture)) {
                set("--width", "32");
            }
        }
        "baselines" => {
            set("--episodes", "1");
            cheap.extend(["--set".into(), "env.horizon=3".into()]);
        }
        "sweep" if !arguments.iter().any(|word| word == "--list") => {
            // `--list` conflicts with `--index`.
            if let Some(index) = cheap.iter().position(|word| word == "--index") {
                cheap.drain(index..index + 2);
            }
            cheap.push("--list".into());
        }
        _ => {}
    }
    cheap
}

#[test]
fn every_command_and_every_table_of_the_book_is_taken() {
    let mut pages: Vec<_> = fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path()).collect();
    pages.retain(|page| page.extension().is_some_and(|extension| extension == "md"));
    pages.push(root().join("README.md"));
    pages.sort();
    let spaces = fs::read_to_string(root().join("docs/tutorial-space.md")).unwrap();
    let (name, soft) = tables(&spaces).remove(0);
    assert_eq!(name.as_deref(), Some("soft.toml"));
    let (mut ran, mut read) = (0, 0);
    for page in pages {
        let text = fs::read_to_string(&page).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        for name in ["results", "experiments"] {
            symlink(root().join(name), here.join(name)).unwrap();
        }
        fs::write(here.join("soft.toml"), &soft).unwrap();
        fs::copy(root().join("experiments/configs/study/table-1.toml"), here.join("table-1.toml")).unwrap();
        let run = |name: &str, arguments: &[String]| {
            let output = program(name).current_dir(here).args(arguments).output().unwrap();
            let told = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{}: {name} {}: {told}", page.display(), arguments.join(" "));
        };
        fs::write(here.join("arm.urdf"), six_joints()).unwrap();
        for (name, block) in tables(&text) {
            let file = name.unwrap_or_else(|| "block.toml".into());
            fs::write(here.join(&file), &block).unwrap();
            if block.contains("[[group]]") {
                run("sweep", &[file, "--list".into()]);
            } else if block.contains("interface =") {
                HostSetup::from_toml(&block).unwrap();
            } else if block.contains("urdf =") {
                run("train", &["--describe".into(), "--robot".into(), file]);
            } else {
                run("train", &["--describe".into(), "--space".into(), file]);
            }
            read += 1;
        }
        for command in commands(&text) {
            let (name, arguments) = command.split_first().unwrap();
            run(name, &cheap(name, arguments));
            ran += 1;
        }
    }
    assert!(ran > 15 && read > 5, "{ran} commands, {read} tables");
}
