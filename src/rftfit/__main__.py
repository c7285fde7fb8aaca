"""``python -P -m rftfit RULE``: one job of the workflow (`rftfit.workflow.job`)."""

import sys

from rftfit.workflow.job import main
from rftfit.workflow.processes import end_with_parent

if __name__ == "__main__":
    end_with_parent()
    sys.exit(main())
