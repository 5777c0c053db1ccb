//! Lets the tests and benchmarks of this crate find libtorch.

fn main() {
    libtorch::link();
}
