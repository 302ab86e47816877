//! `trace.csv` and `recording.toml`.
