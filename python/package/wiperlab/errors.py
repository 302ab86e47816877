"""The exceptions of this package."""


class WiperlabError(Exception):
    """Any refusal or failure."""


class InputError(WiperlabError, ValueError):
    """Bad input: file, key or argument, what was found, what was expected and what to do."""


class MissingFileError(InputError, FileNotFoundError):
    """A file that is not there."""


class InternalError(WiperlabError, RuntimeError):
    """A defect, or a machine that has failed."""
