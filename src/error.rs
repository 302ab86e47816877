//! The sum of the module errors.
