//! Writes the Wipe scene for MuJoCo: `export_wipe FILE`.

use std::{env, fs};

use physics::mjcf;
use physics::panda::ParameterSet;
use physics::scenes::wipe::{TABLE_FRICTION, TABLE_HEIGHT, scene};

fn main() {
    let file = env::args().nth(1).expect("usage: export_wipe FILE");
    let (scene, _) = scene(&ParameterSet::Robosuite.parameters(), TABLE_HEIGHT, TABLE_FRICTION);
    fs::write(file, mjcf::export(&scene, 0.002)).expect("the file can be written");
}
