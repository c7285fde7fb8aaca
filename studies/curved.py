"""Coverage and width of the force at stated depths where stress goes as a power of depth: curved.py [CAMPAIGNS]."""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from curved_depths import forces_held

CAMPAIGNS, SEED, POWERS = 400, 1, (1.1, 1.3)


def main():
    """Print both tables; fail where a coverage or a width is not as promised."""
    campaigns, good = int(sys.argv[1]) if len(sys.argv) > 1 else CAMPAIGNS, True
    for power in POWERS:
        coverage = forces_held("poppy_LP", campaigns, SEED, {"power": power})
        print(
            f"depth^{power:g}, {campaigns} campaigns\n{coverage.round(3).to_string()}\n", flush=True
        )
        good &= bool(
            coverage["inside"].between(0.92, 0.98).all() and (coverage["width"] <= 1.3).all()
        )
    sys.exit(not good)


if __name__ == "__main__":
    main()
