//! The program: arguments in, exit status out; all else is in the library.

fn main() {}
