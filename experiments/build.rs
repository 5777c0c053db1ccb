//! Lets the programs and tests of this package find libtorch.

fn main() {
    libtorch::link();
}
