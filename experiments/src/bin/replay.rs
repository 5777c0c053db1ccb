//! Shows an episode: an interactive page, PNG, GIF, and forces, stiffness and torques over time as curves and numbers.

fn main() -> std::process::ExitCode {
    experiments::programs::alone(experiments::programs::replay::run)
}
