//! Run folders to the archive of their experiments.

fn main() -> std::process::ExitCode {
    experiments::programs::alone(experiments::programs::archive::run)
}
