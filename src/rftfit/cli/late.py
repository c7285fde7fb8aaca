"""Late loading: a library is loaded at the first use of one of its names, although modules import it at the top.

So a command that mostly ends without pandas does not wait for it.
`importlib.util.LazyLoader` does not serve: it loads a library as soon as another module imports it.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any


class _LateModule(ModuleType):
    """Stands for a library until one of its names is used."""

    def __getattr__(self, name: str) -> Any:
        # called for a name that this object lacks, and so for each of the library: it is loaded in place of this object
        if sys.modules.get(self.__name__) is self:
            del sys.modules[self.__name__]
        return getattr(import_module(self.__name__), name)


def load_late(name: str) -> None:
    """Let `import NAME` return without loading the library; for a command that mostly ends without it.

    `name`: Of a library or of a module in one, whose package is then loaded.
    """
    if name not in sys.modules:
        late = _LateModule(name)
        late.__spec__ = find_spec(name)
        sys.modules[name] = late
        package, _, inside = name.rpartition(".")
        if package:
            setattr(sys.modules[package], inside, late)
