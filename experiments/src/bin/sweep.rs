//! Many runs from one file: `sweep experiments/configs/study/table-1.toml`.

experiments::hold_signals!();

fn main() -> std::process::ExitCode {
    experiments::programs::alone(experiments::programs::sweep::run)
}
