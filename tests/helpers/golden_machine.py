"""Whether this is the machine, and these the numerical libraries, that wrote the expected tables."""

import hashlib
import platform
from importlib.metadata import version
from pathlib import Path

from golden_campaigns import GOLDEN

FINGERPRINT = GOLDEN / "machine.sha256"
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


def is_same_machine():
    """Return whether the expected tables were written here."""
    is_known = FINGERPRINT.is_file()
    return is_known and FINGERPRINT.read_text(encoding="utf-8").strip() == fingerprint()


def write_machine():
    """Store the fingerprint beside the expected tables."""
    FINGERPRINT.write_text(f"{fingerprint()}\n", encoding="utf-8")
