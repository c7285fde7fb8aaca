"""Exit codes of ``rftfit`` and their meanings in words; the help text and the documentation are made from them."""

from rftfit.errors import InputError, OutputError, RftfitError, WorkflowError

FINE = 0
UNEXPECTED = RftfitError.exit_code
INPUT_NOT_VALID = InputError.exit_code
OUTPUT_NOT_WRITTEN = OutputError.exit_code
WORKFLOW_STOPPED = WorkflowError.exit_code
NOT_AS_RECORDED = 5
INTERRUPTED = 130
PIPE_CLOSED = 141

MEANINGS = {
    FINE: "fine",
    UNEXPECTED: "something unexpected; a crash report is written",
    INPUT_NOT_VALID: "command line, config, run sheet or log not valid",
    OUTPUT_NOT_WRITTEN: "a result cannot be written, or a strict run has none",
    WORKFLOW_STOPPED: "the workflow stopped",
    NOT_AS_RECORDED: "rftfit verify: results are not, or not made from, what is recorded",
    INTERRUPTED: "stopped by Ctrl-C",
    PIPE_CLOSED: "whoever read the output stopped reading",
}
"""Meanings in words, by exit code."""
