"""The unit push of the live page, calculated once for each setting that it depends on.

Every page has it, it takes a fifth of the time of a page, and with the published shapes it is the same in most campaigns.
"""

from contextlib import contextmanager
from functools import cache

import pytest

from rftfit.forces import model_error
from rftfit.model import shapes
from rftfit.page import live
from rftfit.results import Results


@contextmanager
def shared_unit_push():
    """Pages of one process share what an exact push tells, where no medium of the campaign is a known shape."""
    plain = live._unit_push
    pending: dict[tuple[object, ...], Results] = {}

    @cache
    def calculated(key):
        return plain(pending[key])

    def shared(results):
        config = results.config
        if config.maps.own_media:
            return plain(results)
        legs = tuple((name, leg.model_dump_json()) for name, leg in config.legs.items())
        draws = shapes.DRAWS, model_error.DRAWS
        key = (
            legs,
            config.arm.leg_speed_rad_per_s,
            config.fit.confidence,
            results.model_error,
            draws,
        )
        pending[key] = results
        try:
            return calculated(key)
        finally:
            del pending[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(live, "_unit_push", shared)
        yield
