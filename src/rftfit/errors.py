"""What can go wrong, as exceptions whose text a user can act on, each with its exit code."""

from __future__ import annotations


class RftfitError(Exception):
    """Base of every error that is shown to the user as one message, without a traceback."""

    exit_code = 1


class InputError(RftfitError):
    """Config, run sheet or log cannot be used; the message names file, place, found and allowed."""

    exit_code = 2


class OutputError(RftfitError):
    """A result cannot be written."""

    exit_code = 3


class WorkflowError(RftfitError):
    """The workflow stopped."""

    exit_code = 4
