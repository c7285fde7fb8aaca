"""Exceptions whose text a user can act on, each with the exit code of the command that it ends."""

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
    """A prediction goes beyond what was measured or tested; the text is a sentence of `beyond_measured`.

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
    """Errors of several independent inputs, collected to be reported together as one `InputError`.

    So that a user mends all inputs at once: read each input in ``with errors.collect():``, then call `check`.
    """

    def __init__(self) -> None:
        self._messages: list[str] = []

    @contextmanager
    def collect(self) -> Iterator[None]:
        """Catch an `InputError` of the block of a ``with`` statement and keep its text for `check`."""
        try:
            yield
        except InputError as error:
            self._messages.append(str(error))

    def check(self) -> None:
        """Raise one `InputError` with the texts of all caught errors, if there are any."""
        if self._messages:
            raise InputError("\n".join(self._messages))
