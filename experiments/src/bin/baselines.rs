//! What needs no learning: scripted experts and random actions in every action space.

fn main() -> std::process::ExitCode {
    experiments::programs::alone(experiments::programs::baselines::run)
}
