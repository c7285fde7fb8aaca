import pytest

from rftfit.lab.plan import plan_runs


@pytest.fixture(scope="session")
def config(paper_config):
    return paper_config


@pytest.fixture(scope="session")
def runs(config):
    """All runs of the demonstration, by run_id."""
    return {run.run_id: run for run in plan_runs(config)}
