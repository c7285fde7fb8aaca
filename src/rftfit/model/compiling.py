"""The rule when the compiled kernel replaces numpy: to import it takes as long as millions of elements in numpy."""

from __future__ import annotations

ELEMENTS_AT_ONCE = 500_000
"""Fewest elements of one call for which the compiler is imported, which takes 0.5 s (`benchmarks/kernel.py`)."""


def is_worth_compiling(elements: int) -> bool:
    """Return True if a calculation of this many elements, over all poses, is left to the compiled kernel.

    The answer depends on this call alone, not on whether the kernel is already imported: kernel and numpy differ in the
    last bit, and earlier calls of a process must not change a number.
    """
    return elements >= ELEMENTS_AT_ONCE
