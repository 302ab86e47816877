//! Turns failures of the Rust code into Python exceptions of the module `wiperlab.errors`.

use pyo3::PyErr;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};
use wiperlab::cli::read::Failure;

/// Makes an exception of the given class of `wiperlab.errors`.
fn new_exception(py: Python<'_>, class: &str, message: String) -> PyErr {
    let made = py.import("wiperlab.errors").and_then(|errors| errors.getattr(class)?.call1((message,)));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// Makes an `InputError`, the Python exception for bad input.
pub fn input_error(py: Python<'_>, message: impl ToString) -> PyErr {
    new_exception(py, "InputError", message.to_string())
}

/// Makes an `InternalError`, the Python exception for a defect of the program.
pub fn internal_error(py: Python<'_>, message: impl ToString) -> PyErr {
    new_exception(py, "InternalError", message.to_string())
}

/// Makes the Python exception for a failure of the program.
pub fn failure_error(py: Python<'_>, failure: Failure) -> PyErr {
    match failure {
        Failure::Input(message) => input_error(py, message),
        Failure::Internal(message) => internal_error(py, message),
    }
}

/// Runs Rust code. If the code panics, the panic is returned as a Python exception.
pub fn catch_panic<T>(py: Python<'_>, work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|panic| Err(internal_error(py, panic_message(&*panic))))
}

/// The text with which Rust code panicked.
pub fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let said = panic.downcast_ref::<String>().cloned();
    let said = said.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
    format!("internal failure: {}; please report it", said.unwrap_or_else(|| "no message".to_owned()))
}
