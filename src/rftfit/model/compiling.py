"""When the compiled kernel takes over from numpy: its import takes as long as millions of elements in numpy."""

from __future__ import annotations

IMPORT_ELEMENTS = 2_000_000
"""Elements whose alpha numpy calculates while the compiler is imported, 0.5 s (`benchmarks/kernel.py`)."""

ELEMENTS_AT_ONCE = 500_000
"""Elements of one call for which the compiler is imported at once: who has so many asks again."""


class Workload:
    """Elements that one process has asked for, in calls of any size."""

    def __init__(self) -> None:
        self.asked = 0

    def is_worth_compiling(self, elements: int) -> bool:
        """Whether a calculation of so many elements is one for the compiled kernel, and with it all later ones.

        Few elements never import the compiler; many small calls cost at most twice of what is best. What counts is
        what was asked for, not whether something else imported the compiler: a job's numbers are those of the job alone.
        """
        self.asked += elements
        if elements >= ELEMENTS_AT_ONCE:
            self.asked = max(self.asked, IMPORT_ELEMENTS)
        return self.asked >= IMPORT_ELEMENTS


is_worth_compiling = Workload().is_worth_compiling
"""Counts the elements of this process."""
