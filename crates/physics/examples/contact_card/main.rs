//! The contact card: how Rapier and MuJoCo simulate contacts whose answer is known, or which matter for the tasks.
//!
//! `contact_card FOLDER` measures Rapier, takes MuJoCo's figures from `reference/contact_card.csv`, and writes
//! FOLDER/contact.csv and FOLDER/README.md. `contact_card --mjcf FOLDER` writes the scenes for
//! `scripts/mujoco_contact_card.py`, which makes that reference.

mod bench;
mod cases;
mod page;

use std::path::Path;
use std::{env, fs, process};

use physics::mjcf;

use crate::page::Row;

const REFERENCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/reference/contact_card.csv");

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["--mjcf", folder] => write_scenes(Path::new(folder)),
        [folder] if !folder.starts_with('-') => write_card(Path::new(folder)),
        _ => {
            eprintln!("usage: contact_card FOLDER | contact_card --mjcf FOLDER");
            process::exit(2)
        }
    }
}

fn write_scenes(folder: &Path) {
    fs::create_dir_all(folder).expect("the folder can be made");
    for (name, scene) in cases::scenes() {
        fs::write(folder.join(format!("{name}.xml")), mjcf::export(&scene, bench::DT)).expect("the folder is writable");
    }
}

fn write_card(folder: &Path) {
    let reference = fs::read_to_string(REFERENCE).expect("a file of this repository");
    let rows: Vec<Row> = cases::all().into_iter().map(|figure| Row::new(figure, &reference)).collect();
    fs::create_dir_all(folder).expect("the folder can be made");
    fs::write(folder.join("contact.csv"), page::csv(&rows)).expect("the folder is writable");
    fs::write(folder.join("README.md"), page::markdown(&rows)).expect("the folder is writable");
}
