//! Trains one policy: `train --task lift --space aforce --seed 1`.

fn main() -> std::process::ExitCode {
    experiments::programs::alone(experiments::programs::train::run)
}
