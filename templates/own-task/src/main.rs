//! All programs of the workbench, with a task of one's own: `cargo run --release -- train --task drawer`.

mod drawer;

use std::process::ExitCode;

use tasks::TaskKind;

const DRAWER: TaskKind = TaskKind::new("drawer", "pull a drawer open", drawer::create)
    .defaults(|env| env.horizon = 300)
    .own_disturbances(drawer::DISTURBANCES);

fn main() -> ExitCode {
    experiments::main(&[DRAWER])
}
