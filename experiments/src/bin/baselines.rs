//! Plays scripted experts and random actions, which need no learning, in every action space.

fn main() -> std::process::ExitCode {
    experiments::programs::alone(experiments::programs::baselines::run)
}
