//! Packs run folders into an archive per experiment.

fn main() -> std::process::ExitCode {
    experiments::programs::alone(experiments::programs::archive::run)
}
