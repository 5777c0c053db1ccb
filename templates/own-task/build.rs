//! Lets the program find libtorch.

fn main() {
    libtorch::link();
}
