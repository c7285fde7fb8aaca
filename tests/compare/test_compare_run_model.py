"""The model of the runs against the same written out as one covariance matrix of all slopes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rftfit.model.run_model import RunGaussian, prior_at

DIRECTION = np.array([0, 0, 1, 2, 2, 2])
RUNS = DIRECTION.size


def positive(luck, count, size):
    root = luck.normal(size=(count, size, size))
    return root @ root.transpose(0, 2, 1) + 0.1 * np.eye(size)


@pytest.fixture
def model():
    luck = np.random.default_rng(1)
    return RunGaussian(positive(luck, RUNS, 2), DIRECTION, positive(luck, 1, 6)[0])


def written_out(model):
    """Covariance of all slopes, z first."""
    covariance = np.zeros((2 * RUNS, 2 * RUNS))
    for run in range(RUNS):
        both = [run, RUNS + run]
        covariance[np.ix_(both, both)] = model.scatter[run]
    columns = np.concatenate([DIRECTION, 3 + DIRECTION])
    return covariance + model.shared[np.ix_(columns, columns)]


def test_solve_score_and_determinant(model):
    covariance = written_out(model)
    assert model.log_det == pytest.approx(np.linalg.slogdet(covariance)[1])
    inverse = np.linalg.inv(covariance)
    columns, mean = np.random.default_rng(2).normal(size=(2 * RUNS, 3)), np.arange(1.0, 13)
    assert_allclose(model.solve(columns), inverse @ columns, atol=1e-9)
    assert_allclose(model.solve(columns[:, 0]), inverse @ columns[:, 0], atol=1e-9)
    scores, information = model.score(columns[:, 0], mean, columns[:, 1:])
    free = inverse - np.outer(inverse @ mean, mean @ inverse) / (mean @ inverse @ mean)
    assert_allclose(scores, columns[:, 1:].T @ free @ columns[:, 0], atol=1e-9)
    assert_allclose(information, columns[:, 1:].T @ free @ columns[:, 1:], atol=1e-9)


def test_each_run_is_predicted_from_all_others(model):
    covariance = written_out(model)
    residual = np.random.default_rng(3).normal(size=2 * RUNS)
    predicted, error = model.leave_out(residual.reshape(2, RUNS))
    for run in range(RUNS):
        others = [place for place in range(2 * RUNS) if place % RUNS != run]
        both = [DIRECTION[run], 3 + DIRECTION[run]]
        of_others = np.concatenate([DIRECTION, 3 + DIRECTION])[others]
        towards = model.shared[np.ix_(both, of_others)]
        inverse = np.linalg.inv(covariance[np.ix_(others, others)])
        assert_allclose(predicted[:, run], towards @ inverse @ residual[others], atol=1e-9)
        expected = model.shared[np.ix_(both, both)] - towards @ inverse @ towards.T
        assert_allclose(error[run], expected, atol=1e-9)


def test_the_plate_at_minus_90_degrees_has_the_prior_of_that_at_90():
    gamma_deg = np.array([45.0, 45.0])
    mean, covariance = prior_at(np.array([-90.0, 90.0]), gamma_deg)
    assert_allclose(mean[::2], mean[1::2])
    assert_allclose(covariance[0], covariance[1])
