//! Plays the fixed evaluation episodes and prints what they cost and earned.

fn main() -> std::process::ExitCode {
    experiments::programs::alone(experiments::programs::evaluate::run)
}
