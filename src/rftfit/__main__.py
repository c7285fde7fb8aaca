"""``python -m rftfit``: the command ``rftfit``."""

import sys

from rftfit.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
