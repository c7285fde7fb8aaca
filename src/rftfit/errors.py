"""What can go wrong, as exceptions whose text a user can act on, each with its exit code."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class RftfitError(Exception):
    """Base of every error whose text a user can act on: file, place, what was found, what is allowed.

    Examples
    --------
    >>> import rftfit
    >>> try:
    ...     rftfit.open("no such folder")
    ... except rftfit.RftfitError as error:
    ...     print(error.exit_code)
    2
    """

    exit_code = 1


class LimitWarning(UserWarning):
    """A prediction leaves what was measured or tested; the text is a sentence of `beyond_measured`.

    Examples
    --------
    >>> import warnings
    >>> import rftfit
    >>> warnings.simplefilter("error", rftfit.LimitWarning)  # stop there # doctest: +SKIP
    """


class InputError(RftfitError):
    """Config, run sheet or log cannot be used; the message names file, place, found and allowed."""

    exit_code = 2


class OutputError(RftfitError):
    """A result cannot be written."""

    exit_code = 3


class WorkflowError(RftfitError):
    """The workflow stopped."""

    exit_code = 4


class CollectedErrors:
    """Errors of several independent inputs, reported together."""

    def __init__(self) -> None:
        self._found: list[str] = []

    @contextmanager
    def collect(self) -> Iterator[None]:
        """Keep an error of this input for `check`."""
        try:
            yield
        except InputError as error:
            self._found.append(str(error))

    def check(self) -> None:
        """Raise one error with the text of all kept errors, if there are any."""
        if self._found:
            raise InputError("\n".join(self._found))
