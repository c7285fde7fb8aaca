"""Maps and the model's error from few draws, where a test is not about their intervals."""

import contextlib
from unittest.mock import patch

from rftfit.forces import model_error
from rftfit.model import shapes

MODULES = shapes, model_error
COUNT = 200


@contextlib.contextmanager
def few_draws():
    """Make a fifth of the draws of maps and of the model's own error."""
    with contextlib.ExitStack() as stack:
        for module in MODULES:
            stack.enter_context(patch.object(module, "DRAWS", COUNT))
        yield
