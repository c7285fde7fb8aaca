"""Logs of real programs are read whole, or with lost rows counted, or refused with the reason."""

import numpy as np
import pytest
from log_files import refused
from makers import json_of, sentence_of
from third_party import LOGS, OTHERWISE, inspected, needs

import rftfit
from rftfit.logs.registry import dialect

pytestmark = needs(LOGS)

TEXTS = {
    "ati_netft/R2_2018_04_11_Thrust_Acro": ("ati-netft", 8412),
    "ati_netft/R2_2018_07_23_manual02_FT": ("ati-netft", 7344),
    "ati_daq/log_20231008_13inch_auto7.csv": ("ati-daq", 22512),
    "instron/Tensile_test_PE.csv": ("instron", 12660),
    "instron/cyclic_W27_PA_Cream.csv": ("instron", 239),
    "labview/short.lvm": ("lvm", 10),
    "labview/with_comments.lvm": ("lvm", 9),
    "ros1/ur3_wrench.csv": ("rostopic", 7718),
    "ros1/ur3_wrench_noforces.csv": ("rostopic", 2462),
}
"""File to its dialect and number of rows."""
REFUSED = {
    "ati_netft/R2_2018_04_11_Thrust_Acro_actually": {},
    "ati_netft/R2_2018_07_20_manual01": {"rate_Hz": 125},
    "ati_daq/log_20231002_10inch1R_test2.csv": {},
}
"""File without a data line, and options that do not help."""


@pytest.mark.parametrize("file", TEXTS)
def test_read(file):
    name, rows = TEXTS[file]
    content = json_of("inspect", LOGS / file)
    (clock,) = content["clocks"]
    assert (content["dialect"], clock["rows"]) == (name, rows)
    assert clock["used"] == rows or file.endswith("PE.csv")


@pytest.mark.parametrize("file", REFUSED)
def test_refused(file):
    with pytest.raises(rftfit.RftfitError) as caught:
        rftfit.read_log(LOGS / file)
    assert getattr(caught.value, "code", "") == "header_only"
    if not REFUSED[file]:
        return
    assert all(words in str(caught.value) for words in ("RDT Sample Rate: 0 ", "Force Units: ?"))
    refused(dialect("ati-netft").with_options(REFUSED[file]), LOGS / file, "header_only")


@pytest.mark.parametrize("file", OTHERWISE)
def test_every_number_is_that_of_another_reader(file):
    reader, columns, _ = OTHERWISE[file]
    log = rftfit.read_log(LOGS / file)
    np.testing.assert_array_equal(np.stack(list(log.columns.values()), axis=1), reader(LOGS / file))
    ((survey,), _) = inspected(LOGS / file)
    quantities = survey.quantities
    assert {q: list(log.columns).index(name) for q, name in quantities.items()} == columns
    unit = {"instron": "N", "zwick": "N", "ur_rtde": "", "texture_analyser": "gf"}
    assert log.units[quantities["F3"]] == unit[file.partition("/")[0]]
    assert not log.dropped


def test_lost_packets():
    """Time is the packet's number over the rate, whatever is missing in between; forces are in N, not in counts."""
    log = rftfit.read_log(LOGS / "ati_netft/R2_2018_04_11_Thrust_Acro")
    first, last = 26049, 36421
    assert [*log.missing.values()] == [last - first + 1 - log.rows] == [1961]
    assert log.columns["time"][-1] == pytest.approx((last - first) / 125)
    assert log.units["Fz"] == "N"
    assert np.abs(log.columns["Fz"]).max() == pytest.approx(38.476, abs=1e-3)


def test_regrouped_digits_cost_the_column_and_not_the_file():
    path, reader = LOGS / "instron/Tensile_test_PE.csv", dialect("instron")
    log = reader.load(path)
    assert list(log.dropped) == [sentence_of("grouped")]
    assert log.size + log.dropped.popitem()[1] == 12660
    # what is left is one smooth pull: no value off by a power of ten
    assert (np.diff(log.columns["Displacement"]) > 0).all()
    assert log.columns["Displacement"][-1] == pytest.approx(210.53)
    only = reader.only({"Time", "Force"}).load(path)
    assert (only.size, only.dropped) == (12660, {})


def test_columns_and_units():
    log = dialect("lvm").load(LOGS / "labview/with_comments.lvm")
    assert list(log.columns) == ["time", "X_Value", "Pressão ABS.", "Temperatura", "Volume"]
    assert [log.units[name] for name in list(log.columns)[2:]] == ["MPa", "°C", "ml"]
    log = dialect("lvm").load(LOGS / "labview/short.lvm")
    assert log.columns["time"][-1] == pytest.approx(9 * 3.90625e-5)
    assert log.columns["Excitation"][0] == pytest.approx(0.914018)
    log = dialect("rostopic").load(LOGS / "ros1/ur3_wrench.csv")
    assert "F3: wrench.force.z" in "\n".join(
        json_of("inspect", LOGS / "ros1/ur3_wrench.csv")["config"]
    )
    assert np.median(np.diff(log.columns["time"])) == pytest.approx(1 / 125, rel=1e-3)
