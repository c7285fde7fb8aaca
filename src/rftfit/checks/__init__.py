"""Checks of a medium, each declared beside the function that does it; importing this package declares all checks."""

from importlib import import_module
from pkgutil import iter_modules
from typing import get_args

from rftfit.campaign.config import CheckName
from rftfit.checks.declared import CHECKS

# a module that is imported declares its checks
for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
assert CHECKS.keys() == {*get_args(CheckName)}
