//! What the fuzzer checks of the files that the program reads.

pub mod imports;
pub mod readers;
