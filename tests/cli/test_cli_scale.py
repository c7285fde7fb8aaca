"""`rftfit scale`: numbers against hand calculation, sources, files, messages."""

from __future__ import annotations

import csv
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rftfit import reference
from rftfit.cli.scale import (
    alpha_with_interval,
    coefficients_with_interval,
    from_results,
    scale_from,
)
from rftfit.errors import InputError
from rftfit.model.fourier import TERMS, evaluate
from rftfit.model.scaling import Reference, published, with_interval

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from .conftest import Said

T_4 = 2.776445  # Student, two-sided 95 %, four degrees of freedom
CHI = (1.37, 1.19, 1.27, 1.05, 1.33)  # Table S3
M0 = (0.206, 0.169, 0.212, 0.358, 0.055, -0.124, 0.253, 0.007, 0.088)  # Table S2


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def as_json(said: Said) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(said.out)
    return content


def read_table(path: Path) -> dict[tuple[float, float], dict[str, float]]:
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    rows = [{name: float(cell) for name, cell in row.items()} for row in csv.DictReader(lines)]
    return {(row["beta_deg"], row["gamma_deg"]): row for row in rows}


def test_published_source_is_as_printed() -> None:
    source = published()
    assert source.media == reference.MEDIA
    assert source.chi.tolist() == list(CHI)
    assert source.m0.tolist() == list(M0)
    assert source.scaled.shape == (5, 9)
    assert np.allclose(source.scaled[:, :5].sum(axis=1), 1)
    # the printed generic coefficients are the mean over the media, to the digits printed
    assert np.abs(source.scaled.mean(axis=0) - source.m0).max() < 0.0065


def test_numbers_by_hand(rftfit: Callable[..., Said], here: Path) -> None:
    said = rftfit("scale", "--alpha", "0.9", "--json")
    assert (said.code, said.err) == (0, "")
    result = as_json(said)
    mean = sum(CHI) / 5
    logs = [math.log(chi) for chi in CHI]
    middle = sum(logs) / 5
    spread = math.sqrt(sum((x - middle) ** 2 for x in logs) / 4 * (1 + 1 / 5))
    zeta = 0.9 / mean
    assert result["zeta"]["value"] == pytest.approx(zeta)
    assert result["zeta"]["lo"] == pytest.approx(zeta * math.exp(-T_4 * spread), rel=1e-3)
    assert result["zeta"]["hi"] == pytest.approx(zeta * math.exp(T_4 * spread), rel=1e-3)
    assert result["chi"]["value"] == pytest.approx(mean)
    found = result["coefficients_N_per_cm3"]
    assert [found[term]["value"] for term in TERMS] == pytest.approx([zeta * m for m in M0])
    assert all(found[term]["lo"] < found[term]["value"] < found[term]["hi"] for term in TERMS)

    table = read_table(here / "alpha.csv")
    assert len(table) == 7 * 13
    assert {key[0] for key in table} == set(reference.BETA_DEG)
    assert sorted({key[1] for key in table}) == pytest.approx(reference.GAMMA_DEG, abs=0.005)
    # generic profile at (30, 45) and (0, 90) deg: 0.734 and 0.294, 1 and 0
    assert table[30, 45]["alpha_z_N_per_cm3"] == pytest.approx(0.734 * zeta, abs=6e-4)
    assert table[30, 45]["alpha_x_N_per_cm3"] == pytest.approx(0.294 * zeta, abs=6e-4)
    straight_down = table[0, 90]
    assert straight_down["alpha_z_N_per_cm3"] == pytest.approx(zeta, abs=1e-6)
    assert straight_down["alpha_x_N_per_cm3"] == 0
    # there the generic profile is 1 for every medium: only zeta's own error is left
    assert straight_down["alpha_z_lo_N_per_cm3"] == pytest.approx(result["zeta"]["lo"], rel=1e-5)
    assert straight_down["alpha_z_hi_N_per_cm3"] == pytest.approx(result["zeta"]["hi"], rel=1e-5)


def test_everything_scales_with_alpha() -> None:
    source = published()
    one, two = (scale_from(source, alpha, alpha / 20, 0.95) for alpha in (0.4, 0.8))
    for first, second in zip(
        coefficients_with_interval(one, source, 0.95),
        coefficients_with_interval(two, source, 0.95),
        strict=True,
    ):
        assert second == pytest.approx(2 * first)


def test_intervals_grow_with_se_and_confidence(rftfit: Callable[..., Said]) -> None:
    def width(*more: str) -> float:
        zeta = as_json(rftfit("scale", "--alpha", "0.9", "--json", *more))["zeta"]
        return float(zeta["hi"] - zeta["lo"])

    errors = [width("--se", se) for se in ("0", "0.01", "0.05", "0.1", "0.3")]
    widths = [width("--confidence", "0.8"), width("--confidence", "0.9"), *errors]
    assert widths == sorted(widths)
    assert len(set(widths)) == 7
    assert width() == errors[0]


def test_no_scatter_leaves_the_error_of_zeta() -> None:
    scaled = scale_from(published(), 0.9, 0.0, 0.95)
    generic = np.array([2.0, -1.0, 0.0])
    value, lo, hi = with_interval(scaled, generic, np.tile(generic, (5, 1)), 0.95)
    assert value == pytest.approx(scaled.zeta * generic)
    assert lo == pytest.approx([2 * scaled.zeta_lo, -scaled.zeta_hi, 0])
    assert hi == pytest.approx([2 * scaled.zeta_hi, -scaled.zeta_lo, 0])


def test_intervals_hold_for_a_medium_left_out() -> None:
    whole = published()
    beta, gamma = np.radians(reference.BETA_DEG)[:, None], np.radians(reference.GAMMA_DEG)
    of_coefficients, of_profiles = [], []
    for i, medium in enumerate(whole.media):
        rest = [j for j in range(5) if j != i]
        scaled = whole.scaled[rest]
        four = Reference("", tuple(whole.media[j] for j in rest), whole.chi[rest],
                         scaled.mean(axis=0), scaled)  # fmt: skip
        alpha = reference.alpha_grid(medium)[0][3, -1]
        result = scale_from(four, alpha, 0.0, 0.95)
        own = np.array([reference.coefficients(medium)[term] for term in TERMS])
        _, lo, hi = coefficients_with_interval(result, four, 0.95)
        of_coefficients.append((lo - 1e-9 <= own) & (own <= hi + 1e-9))
        profile = evaluate(own, beta, gamma)
        for truth, (_, low, high) in zip(
            profile, alpha_with_interval(result, four, beta, gamma, 0.95), strict=True
        ):
            of_profiles.append((low - 1e-9 <= truth) & (truth <= high + 1e-9))
    # 45 coefficients and 910 alphas of five media; 0.95 is the promise, five media are few
    assert np.mean(of_coefficients) > 0.9
    assert np.mean(of_profiles) > 0.93


def test_text(rftfit: Callable[..., Said]) -> None:
    said = rftfit("scale", "--alpha", "0.9", "--se", "0.02", "--output", "sand é.csv")
    assert (said.code, said.err) == (0, "")
    lines = {line.split()[0]: line.split()[1:] for line in said.out.splitlines() if line.strip()}
    assert "  zeta   0.7246 " in said.out
    assert lines["A00"][0] == f"{0.206 * 0.9 / 1.242:.4f}"
    assert all(len(lines[term]) == 3 for term in TERMS)
    assert "published Tables S2 and S3" in said.out
    assert said.out.endswith("sand é.csv\n")


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--alpha", "-0.9"], "--alpha: found -0.9; allowed: a positive number"),
        (["--alpha", "0"], "--alpha: found 0;"),
        (["--alpha", "nan"], "--alpha: found nan;"),
        (["--alpha", "inf"], "--alpha: found inf;"),
        (["--alpha", "0,9"], "write a decimal point: 0.9"),
        (["--alpha", "much"], "found 'much'; allowed: a number"),
        (["--alpha", "0.9", "--se", "-1"], "--se: found -1;"),
        (["--alpha", "0.9", "--confidence", "95"], "--confidence: found 95;"),
        (["--alpha", "0.9", "--method", "lsq"], "needs --results"),
        (["--alpha", "0.9", "--results", "none"], "penetration.csv: there is no such table"),
    ],
)
def test_messages(rftfit: Callable[..., Said], here: Path, words: list[str], text: str) -> None:
    said = rftfit("scale", *words)
    assert said.code == 2
    assert text in said.err
    assert list(here.iterdir()) == []


@pytest.mark.parametrize(
    ("alpha", "warned"), [(0.049, True), (0.05, False), (5, False), (900, True)]
)
def test_another_unit(rftfit: Callable[..., Said], alpha: float, warned: bool) -> None:
    said = rftfit("scale", "--alpha", alpha)
    assert said.code == 0
    assert ("another unit" in said.err) is warned


def test_files_of_others_are_left(rftfit: Callable[..., Said], here: Path) -> None:
    mine = here / "alpha.csv"
    mine.write_text("mine")
    said = rftfit("scale", "--alpha", "0.9")
    assert said.code == 2
    assert "was not written by rftfit scale" in said.err
    assert mine.read_text() == "mine"
    assert rftfit("scale", "--alpha", "0.9", "--force").code == 0
    first = mine.read_bytes()
    # its own table it overwrites unasked, and the same numbers are the same bytes
    assert rftfit("scale", "--alpha", "0.8").code == 0
    assert mine.read_bytes() != first
    assert rftfit("scale", "--alpha", "0.9").code == 0
    assert mine.read_bytes() == first


def test_where_nothing_can_be_written(rftfit: Callable[..., Said], here: Path) -> None:
    (here / "file").write_text("")
    said = rftfit("scale", "--alpha", "0.9", "--output", "file/below.csv")
    assert said.code == 3
    assert rftfit("scale", "--alpha", "0.9", "--output", here).code == 3


def write_results(folder: Path, methods: tuple[str, ...] = ("lsq",)) -> None:
    """Tables with two media of the same profile, one term of it dropped."""
    folder.mkdir()
    penetration = ["method,medium,alpha_z_measured_N_per_cm3,chi,zeta"]
    coefficients = ["method,medium,coefficient,value_N_per_cm3,kept"]
    for method in methods:
        for medium, chi, zeta in (("a", 1.1, 0.5), ("b", 1.3, 2.0), ("c", "", "")):
            penetration.append(f"{method},{medium},0.6,{chi},{zeta}")
        for medium, zeta in (("a", 0.5), ("b", 2.0), ("generic", 1.0)):
            for i, term in enumerate(TERMS):
                kept = term != "Cm1"
                coefficients.append(f"{method},{medium},{term},{zeta * M0[i]},{kept}")
    penetration.append("scaling routine (lsq),sand,0.9,1.2,0.75")
    (folder / "penetration.csv").write_text("\n".join(penetration) + "\n")
    (folder / "coefficients.csv").write_text("\n".join(coefficients) + "\n")


def test_results_of_a_campaign(rftfit: Callable[..., Said], here: Path) -> None:
    write_results(here / "results", ("lsq", "dft-index"))
    said = rftfit("scale", "--alpha", "0.9", "--results", "results", "--json")
    assert said.code == 0, said.err
    result = as_json(said)
    assert result["media"] == ["a", "b"]
    assert result["scaled_from"] == "results, method lsq"
    assert result["chi"]["value"] == pytest.approx(1.2)
    assert result["zeta"]["value"] == pytest.approx(0.75)
    found = result["coefficients_N_per_cm3"]
    assert found["A00"]["value"] == pytest.approx(0.75 * 0.206)
    # both media have one and the same profile: the error of zeta is all there is
    assert found["A00"]["lo"] == pytest.approx(result["zeta"]["lo"] * 0.206)
    assert found["Cm1"] == {"value": 0, "lo": 0, "hi": 0}
    said = rftfit(
        "scale", "--alpha", "0.9", "--results", "results", "--method", "dft-index", "--json"
    )
    assert as_json(said)["scaled_from"] == "results, method dft-index"


def test_damaged_results(here: Path) -> None:
    folder = here / "results"
    write_results(folder)
    with pytest.raises(InputError, match=r"no rows of the method 'dft'; allowed: lsq, scaling"):
        from_results(folder, "dft")
    with pytest.raises(InputError, match="at least two media"):
        from_results(folder, "scaling routine (lsq)")
    table = folder / "coefficients.csv"
    whole = table.read_text()
    table.write_text(whole.replace(f"lsq,b,B01,{2 * 0.358}", "lsq,b,B01,"))
    with pytest.raises(InputError, match="no value by 'lsq' for b: B01"):
        from_results(folder, "lsq")
    table.write_text(whole.replace(f"lsq,b,B01,{2 * 0.358}", "lsq,b,B01,x"))
    with pytest.raises(InputError, match="found 'x' in column value_N_per_cm3"):
        from_results(folder, "lsq")
    table.write_text("method,medium\nlsq,a\n")
    with pytest.raises(InputError, match="no column coefficient, value_N_per_cm3"):
        from_results(folder, "lsq")
    table.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="cannot be read as a table"):
        from_results(folder, "lsq")
