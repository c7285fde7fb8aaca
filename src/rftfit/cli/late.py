"""Libraries that a command loads where something of them is used, whichever module imports them.

The loader of `importlib` for this loads a library at the next `import` of it already.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any


class _LateModule(ModuleType):
    """Stands for a library until an attribute of it is wanted."""

    def __getattr__(self, name: str) -> Any:
        if sys.modules.get(self.__name__) is self:
            del sys.modules[self.__name__]
        return getattr(import_module(self.__name__), name)


def load_late(name: str) -> None:
    """Let `import NAME` return at once; for a command that mostly ends without this library."""
    if name not in sys.modules:
        late = _LateModule(name)
        late.__spec__ = find_spec(name)
        sys.modules[name] = late
        package, _, inside = name.rpartition(".")
        if package:
            setattr(sys.modules[package], inside, late)
