"""Whether this is the machine, and these the numerical libraries, that wrote the expected tables."""

import hashlib
import platform
from importlib.metadata import version
from pathlib import Path

FILE = "machine.sha256"
"""Name of the file beside the expected tables."""
LIBRARIES = ("numba", "numpy", "pandas", "scipy")


def fingerprint():
    """Return a digest of processor, system and versions of the numerical libraries."""
    facts = [platform.system(), platform.machine(), platform.python_version(), _processor()]
    facts += [f"{name} {version(name)}" for name in LIBRARIES]
    return hashlib.sha256("\n".join(facts).encode()).hexdigest()


def _processor():
    """Return model and abilities of the processor, on which the order of sums depends."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    wanted = ("model name", "flags", "Features")
    return "\n".join(sorted({line for line in lines if line.startswith(wanted)}))


def is_same_machine(expected):
    """Return whether the tables in this folder were written here."""
    path = expected / FILE
    return path.is_file() and path.read_text(encoding="utf-8").strip() == fingerprint()


def write_machine(expected):
    """Store the fingerprint beside expected tables."""
    (expected / FILE).write_text(f"{fingerprint()}\n", encoding="utf-8")
