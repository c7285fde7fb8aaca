"""When the compiled kernel takes over from numpy: its import takes as long as millions of elements in numpy."""

from __future__ import annotations

ELEMENTS_AT_ONCE = 500_000
"""Elements of one call from which the compiler is imported, 0.5 s (`benchmarks/kernel.py`)."""


def is_worth_compiling(elements: int) -> bool:
    """Whether a calculation of so many elements is one for the compiled kernel.

    What counts is this call alone: both ways differ in the last bit, and what a process did before must change no number.
    """
    return elements >= ELEMENTS_AT_ONCE
