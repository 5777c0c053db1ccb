//! Run folders to tables and pictures.

fn main() -> std::process::ExitCode {
    experiments::programs::alone(experiments::programs::report::run)
}
