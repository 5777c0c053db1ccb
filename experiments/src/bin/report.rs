//! Makes tables and pictures from run folders.

fn main() -> std::process::ExitCode {
    experiments::programs::alone(experiments::programs::report::run)
}
