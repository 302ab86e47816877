//! Derived channels, windows and detrending.
