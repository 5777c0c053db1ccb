//! Trains one policy: `train --task lift --space aforce --seed 1`.

experiments::hold_signals!();

fn main() -> std::process::ExitCode {
    experiments::programs::alone(experiments::programs::train::run)
}
