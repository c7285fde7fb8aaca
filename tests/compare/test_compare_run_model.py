"""The model of the runs against the same written out as one covariance matrix of all slopes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rftfit.model.run_model import Freedom, RunGaussian, Scatter, prior_at

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


def test_solve_and_score(model):
    inverse = np.linalg.inv(written_out(model))
    columns, mean = np.random.default_rng(2).normal(size=(2 * RUNS, 3)), np.arange(1.0, 13)
    assert_allclose(model.solve(columns), inverse @ columns, atol=1e-9)
    assert_allclose(model.solve(columns[:, 0]), inverse @ columns[:, 0], atol=1e-9)
    scores, information = model.score(columns[:, 0], mean, columns[:, 1:])
    free = inverse - np.outer(inverse @ mean, mean @ inverse) / (mean @ inverse @ mean)
    assert_allclose(scores, columns[:, 1:].T @ free @ columns[:, 0], atol=1e-9)
    assert_allclose(information, columns[:, 1:].T @ free @ columns[:, 1:], atol=1e-9)


def test_determinant(model):
    assert model.log_det == pytest.approx(np.linalg.slogdet(written_out(model))[1])


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


def test_scatter_of_a_bed_is_along_the_force_and_the_floor_everywhere():
    alpha, se = np.array([[0.3, 0.0], [0.4, 0.1]]), np.array([[0.01, 0.0], [0.02, 0.0]])
    of_beds = Scatter(0.05, 0.0, 0.0, 0.0).covariance(alpha, np.zeros((2, 2)))
    assert_allclose(of_beds[0], 0.05**2 * np.outer([0.3, 0.4], [0.3, 0.4]))
    of_rest = Scatter(0.0, 0.02, 0.3, 0.01).covariance(alpha, se)
    level = [0.5, 0.1]
    for run in (0, 1):
        alone = 0.02**2 * (level[run] ** 2 + (0.3 * 0.5) ** 2) + (0.01 * 0.5) ** 2
        assert_allclose(of_rest[run], np.diag(alone + se[:, run] ** 2))


def test_freedom_scales_x_pulls_and_level_runs():
    gamma_deg = np.array([90.0, 0.0, -45.0])
    mean = np.array([1.0, 2, 3, 4, 5, 6])
    covariance = Freedom(x=0.4, pulls=0.5, level=0.3).covariance(mean, gamma_deg)
    rows = [0.4 * np.array([0, 0, 0, 4, 5, 6]), 0.5 * np.array([0, 0, 3, 0, 0, 6])]
    rows.append(0.3 * np.array([0, 2, 0, 0, 5, 0]))
    assert_allclose(covariance, sum(np.outer(row, row) for row in rows))


def test_the_plate_at_minus_90_degrees_has_the_prior_of_that_at_90():
    gamma_deg = np.array([45.0, 45.0])
    mean, covariance = prior_at(np.array([-90.0, 90.0]), gamma_deg)
    assert_allclose(mean[::2], mean[1::2])
    assert_allclose(covariance[0], covariance[1])
