"""The methods paragraph and the provenance of a page."""

from __future__ import annotations

import platform
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

import rftfit
from rftfit.campaign.config import Leg, Plate
from rftfit.measure.tare import NO_TARE_FLAG
from rftfit.model.outlines import ELEMENTS
from rftfit.model.scaling import published
from rftfit.page.live import scaled_from_print
from rftfit.page.tables import leg_name, run_fates, value

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

    from rftfit.page.page import PageInputs


# --- The methods paragraph: what this run did, in sentences ready to paste, with its references.


def references(inputs: PageInputs) -> list[str]:
    """List the references that `paragraphs` cites by number, in that order."""
    program = inputs.provenance.versions.get("rftfit", "")
    text = f"""
C. Li, T. Zhang, D. I. Goldman, A terradynamics of legged locomotion on granular media, \
Science 339, 1408-1412 (2013), doi:10.1126/science.1229163
The rftfit developers, rftfit: force-transducer logs to resistive-force models of granular media, \
version {program}
E. Lazarus, D. J. Lewis, J. H. Stock, M. W. Watson, HAR inference: recommendations for practice, \
J. Bus. Econ. Stat. 36, 541-559 (2018), doi:10.1080/07350015.2018.1506926
F. M\N{LATIN SMALL LETTER O WITH DIAERESIS}lder et al., Sustainable data analysis with Snakemake, \
F1000Research 10, 33 (2021), doi:10.12688/f1000research.29032.2
C. R. Harris et al., Array programming with NumPy, Nature 585, 357-362 (2020), \
doi:10.1038/s41586-020-2649-2
P. Virtanen et al., SciPy 1.0: fundamental algorithms for scientific computing in Python, \
Nature Methods 17, 261-272 (2020), doi:10.1038/s41592-019-0686-2
"""
    return text.strip().split("\n")


def paragraphs(inputs: PageInputs) -> list[str]:
    """Write the methods section from the configuration and the numbers of this run.

    Returns paragraphs of plain text.
    """
    return [_measurement(inputs), _model(inputs), _trial(inputs)]


def _measurement(inputs: PageInputs) -> str:
    config = inputs.config
    used, dropped = run_fates(inputs.ledger)
    fit, box = config.fit, config.container
    plates = [item for item in config.intruders.values() if isinstance(item, Plate)]
    plate = "a flat plate"
    if plates:
        first = plates[0]
        plate = (
            f"a flat plate ({first.length_cm:g} x {first.width_cm:g} cm^2, "
            f"{first.thickness_cm:g} cm thick)"
        )
    tare = _tare(
        inputs.fits,
        "The force on rod and mount alone, recorded along the same path, was subtracted at the same "
        "depth",
        "No force on rod and mount alone was recorded, so none was subtracted",
    )
    depths = ", ".join(f"{depth:g}" for depth in fit.horizontal_depths_cm)
    return (
        f"Stresses on {plate} were measured in {len(inputs.alpha)} granular media in a container "
        f"of {box.length_cm:g} x {box.width_cm:g} cm^2 and {box.depth_cm:g} cm depth, at "
        f"{config.arm.speed_cm_per_s:g} cm/s, following ref. 1. {sum(used.values())} runs were "
        f"used and {len(dropped)} dropped. "
        f"{tare} The stress per depth alpha(beta, gamma) is "
        "the zero-intercept least-squares slope of stress over depth, over the depths at which "
        "the plate was wholly submerged and further than "
        f"{fit.wall_clearance_cm:g} cm from walls and bottom; for horizontal motion, of the "
        f"steady mean stress over depth at {depths} cm. {100 * fit.confidence:g} % intervals allow "
        "for the correlation of successive samples (ref. 3) and add the errors of the force zero "
        "and of the clocks."
    )


def _tare(table: pd.DataFrame, done: str, nothing: str) -> str:
    """Say whether tares were subtracted from the runs of a table that gave a number."""
    if "reason" in table:
        table = table[table["reason"] == ""]
    if table.empty:
        return f"{done}."
    bare = table["flags"].astype(str).str.contains(NO_TARE_FLAG, regex=False)
    runs = table.loc[bare, "run_id"].nunique()
    if bare.all():
        return f"{nothing}."
    return f"{done}, save for {runs} runs without such a recording." if runs else f"{done}."


def _model(inputs: PageInputs) -> str:
    config = inputs.config
    method = config.fourier.method
    how = (
        "least squares at the true angles over the torus that the mirror symmetry completes"
        if method == "lsq"
        else "the discrete Fourier transform on the index grid that underlies Table S2 of ref. 1"
    )
    own = inputs.penetration[inputs.penetration["method"] == method]
    chi = own["chi"].dropna().to_numpy(float)
    scaled = ""
    if chi.size > 1:
        scaled = (
            f"The ratio chi of measured to fitted alpha_z(0, 90 deg) was {value(chi.mean(), 2)} "
            f"+- {value(chi.std(ddof=1), 2)} (mean and standard deviation of {chi.size} media); "
            "a further medium was scaled from one vertical penetration test by zeta = "
            "alpha_z(0, 90 deg) / chi, with an interval from the scatter between the media."
        )
    if scaled_from_print(inputs):
        chi = published().chi
        scaled = (
            "Natural sands were scaled from one vertical penetration test by zeta = "
            f"alpha_z(0, 90 deg) / chi, with the mean chi ({value(chi.mean(), 2)}) and the generic "
            f"coefficients of the {chi.size} media of ref. 1 (Tables S3 and S2), and an interval from "
            "the scatter between these media."
        )
    if inputs.coefficients.empty:
        return scaled or "No medium was measured over the grid of angles, so nothing was fitted."
    return (
        f"The measured alpha was fitted with the nine-term Fourier series of ref. 1 by {how}; "
        f"terms above {config.fourier.threshold:g} A00 were kept. The scaling factor zeta of a "
        "medium is its fitted alpha_z(0, 90 deg) in N/cm^3, and the generic coefficients are the "
        f"mean of the media's coefficients over their zeta. Intervals are percentiles of "
        f"{config.fourier.draws} parametric bootstrap draws (seed {config.fourier.seed})."
        + (f" {scaled}" if scaled else "")
    )


def _trial(inputs: PageInputs) -> str:
    legs = {n: leg for n, leg in inputs.config.intruders.items() if isinstance(leg, Leg)}
    versions = inputs.provenance.versions
    software = (
        f"All steps were run with rftfit {versions.get('rftfit', '')} (ref. 2; source digest "
        f"{inputs.provenance.code}) under Snakemake {versions.get('snakemake', '')} (ref. 4) with "
        f"NumPy {versions.get('numpy', '')} (ref. 5) and SciPy {versions.get('scipy', '')} (ref. 6)."
    )
    if not legs:
        return software
    first = next(iter(legs.values()))
    names = ", ".join(leg_name(name) for name in legs)
    errors = inputs.leg_errors
    result = ""
    if not errors.empty:
        best = errors[(errors["profile"] == "table") & (errors["component"] == "z")]
        peak = best["peak_error_percent"].dropna().abs()
        if len(peak):
            result = (
                f" With the interpolated measured table the peak lift was predicted within "
                f"{value(peak.max(), 0)} % for all {len(peak)} pairs of leg and medium (median "
                f"{value(peak.median(), 0)} %)."
            )
    laboratory = [name for name in inputs.media if inputs.config.media[name].role == "laboratory"]
    source = (
        "interpolated from the measured table" if laboratory else "of the scaled generic profile"
    )
    tare = _tare(
        inputs.legs,
        "The force in air at the same angle was subtracted",
        "No force in air was recorded, so none was subtracted",
    )
    return (
        f"Model legs ({names}; maximal length {first.max_length_cm:g} cm, width "
        f"{first.width_cm:g} cm, axle {first.hip_height_cm:g} cm above the surface, "
        f"{inputs.config.arm.leg_speed_rad_per_s:g} rad/s) were turned through the medium. "
        f"{tare} Forces were predicted by summing alpha "
        f"|z| dA over {ELEMENTS} elements a leg, alpha {source}, "
        f"clipping elements at the surface.{result} {software}"
    )


# --- Where a page comes from: versions of the software, digests of what it was made from.


LIBRARIES = ("numpy", "scipy", "pandas", "numba", "matplotlib", "pyarrow", "snakemake", "jinja2")
"""Libraries whose version may change a result or the page."""


@dataclass(frozen=True)
class Provenance:
    """Software and inputs of a run.

    `versions`: Version by name, the program first.
    `code`: Digest of the program's source.
    `digests`: Digest by what it is of: the settings, the rows of the run sheet. They do not depend
        on the order of rows, on comments or on line endings.
    """

    versions: Mapping[str, str] = field(default_factory=dict)
    code: str = ""
    digests: Mapping[str, str] = field(default_factory=dict)


def provenance_of(code: str, digests: Mapping[str, str]) -> Provenance:
    """Look up the versions in use.

    `digests`: As in `Provenance`. Returns without date and machine: the same inputs give the same
    page.
    """
    versions = {"rftfit": rftfit.__version__, "Python": platform.python_version()}
    for name in LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return Provenance(versions, code, dict(digests))
