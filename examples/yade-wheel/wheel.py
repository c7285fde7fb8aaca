"""Drawbar and torque of a lugged wheel in a bed of discrete elements, from its load alone.

``python examples/yade-wheel/wheel.py [--from DIR] [FIGURE.png]`` prints the table and draws the figure. Mesh and averages
of the runs are downloaded into the folder ``yade-wheel``, each checked against its sha256; ``--from`` names a folder
that has them. They are under the GPL-3 and no part of this project.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import rftfit
from rftfit.reference import MEDIA
from rftfit.store.digests import read_sums, sha256_of

SOURCE = "https://github.com/Mississippi-State-University-OTM/Yade-DEM-Wheel-Soil-Simulator/raw/0a399180/"
SUMS = Path(__file__).with_name("files.sha256")
MESH = "meshes/wheelKyoto.stl"
SLIPS = {  # by run; of the last one, which drives itself, the average of the run
    "fSlip06p30_2p0kg": 0.0630,
    "fSlip13p05_2p0kg": 0.1305,
    "fSlip21p02_2p0kg": 0.2102,
    "fSlip35p42_2p0kg": 0.3542,
    "fSlip60p00_2p0kg": 0.6000,
    "selfP02p76_2p0kg": 0.0268,
}
RADIUS_CM = 11.0  # over the lugs
TURN_RAD_PER_S = 2.76
POSES = 36  # of a turn; the 18 lugs repeat after 20 degrees
SURFACE_CM = {"fSlip": -19.68, "selfP": -19.74}
"""Height of the surface before the run in the coordinates of the runs, where a lug first touches (time series)."""


def fetch(folder):
    """Download the files that are not there yet; return the folder."""
    sums = read_sums(SUMS)
    lacking = {name: digest for name, digest in sums.items() if not is_right(folder / name, digest)}
    if not lacking:
        return folder
    import pooch

    registry = {name: f"sha256:{digest}" for name, digest in lacking.items()}
    store = pooch.create(path=folder, base_url=SOURCE, registry=registry)
    for name in lacking:
        try:
            store.fetch(name)
        except (OSError, ValueError) as error:
            sys.exit(
                f"{SOURCE}{name}: cannot be downloaded ({str(error).splitlines()[0][:150]}); without a connection, give a "
                "folder that has the files: --from DIR"
            )
    return folder


def is_right(path, digest):
    """Whether a file is there, as it was published."""
    return path.is_file() and sha256_of(path) == digest


def read_runs(folder):
    """One row a run, by slip: height of the axle (cm), forces (N) and torque of the medium on the wheel (N m)."""
    rows = []
    for run, slip in SLIPS.items():
        lines = (folder / "examples" / "Kyoto" / run / "avgs.txt").read_text().splitlines()
        means = {line.split()[0]: float(line.split()[1]) for line in lines if line[0] != "#"}
        rows.append(
            {
                "slip": slip,
                "axle_cm": 100 * means["z"] - SURFACE_CM[run[:5]],
                "drawbar_N": means["Fx"],
                "load_N": means["Fz"],
                "torque_N_m": means["Ty"],
            }
        )
    return pd.DataFrame(rows).sort_values("slip", ignore_index=True)


def mean_profile():
    """Mean of the published maps, each over its own alpha_z(0, 90 deg)."""
    media = [rftfit.TableProfile.published(medium) for medium in MEDIA]
    maps = [np.stack(medium.cells[2:]) / medium.alpha(0, np.pi / 2)[0] for medium in media]
    return rftfit.TableProfile(*np.mean(maps, axis=0).reshape(2, 7, 13))


def predict_runs(mesh, runs, law="measured", friction=None):
    """Alpha (N/cm^3) at which the wheel carries its load at its height, and then its drawbar (N) and torque (N m)."""
    profile = mean_profile()
    turned = rftfit.Motion3D.roll(mesh, 1.0, 0.0, POSES).frames[:, 9:].reshape(-1, 3, 3)
    rows = []
    for run in runs.itertuples():
        travel = (1 - run.slip) * RADIUS_CM * TURN_RAD_PER_S
        motion = rftfit.Motion3D(
            [0, 0, run.axle_cm], [travel, 0, 0], [0, TURN_RAD_PER_S, 0], turned
        )
        forces = rftfit.predict(
            profile, mesh, motion, law=law, friction=friction, model_error=0
        ).mean(numeric_only=True)
        alpha = run.load_N / forces["force_z_N"]
        rows.append(
            {
                "alpha": alpha,
                "drawbar_N": alpha * forces["force_x_N"],
                "torque_N_m": alpha * forces["moment_y_N_cm"] / 100,
            }
        )
    return pd.DataFrame(rows)


def root_mean_square(errors):
    """Root mean square of some errors."""
    return float(np.sqrt((errors**2).mean()))


def draw(runs, predictions):
    """Drawbar and torque over slip: points from the discrete elements, lines predicted."""
    page = Figure(figsize=(7.2, 3.2), layout="constrained")
    for axes, name, label in zip(
        page.subplots(1, 2),
        ("drawbar_N", "torque_N_m"),
        ("drawbar (N)", "torque on the wheel (N m)"),
        strict=True,
    ):
        axes.plot(100 * runs["slip"], runs[name], "ko", label="discrete elements")
        for (case, predicted), colour in zip(
            predictions.items(), ("#0072B2", "#D55E00", "#E69F00"), strict=True
        ):
            axes.plot(100 * runs["slip"], predicted[name], color=colour, label=case)
        axes.set(xlabel="slip (%)", ylabel=label)
        axes.axhline(0, color="#808080", linewidth=0.6)
    page.axes[0].legend(fontsize=7)
    return page


def main(words):
    """Print the table; draw the figure where one is named."""
    folder = Path("yade-wheel")
    if words[:1] == ["--from"]:
        folder, words = Path(words[1]), words[2:]
        sums = read_sums(SUMS)
        if wrong := [name for name in sums if not is_right(folder / name, sums[name])]:
            sys.exit(f"{folder}: {wrong[0]} is not there, or not as published (sha256 differs)")
    else:
        folder = fetch(folder)
    runs = read_runs(folder)
    lugged = rftfit.Mesh.read(folder / MESH, "m")
    cylinder = rftfit.Mesh.cylinder(RADIUS_CM, width_cm=10)
    predictions = {
        "measured law, lugged mesh": predict_runs(lugged, runs),
        "measured law, plain cylinder": predict_runs(cylinder, runs),
        "3D-RFT, lugged mesh": predict_runs(lugged, runs, "3d-rft", 0.4),
    }
    print(f"{len(runs)} runs, slip {100 * runs.slip.min():.0f} to {100 * runs.slip.max():.0f} %")
    print("rms error of           drawbar, N  torque, N m  alpha at the least and largest slip")
    for case, predicted in predictions.items():
        errors = (root_mean_square(predicted[n] - runs[n]) for n in ("drawbar_N", "torque_N_m"))
        ends = " to ".join(f"{predicted['alpha'].iloc[place]:.2f}" for place in (0, -1))
        print(f"{case:28} {next(errors):.2f}  {next(errors):.2f}  {ends}")
    means = (runs[name].abs().mean() for name in ("drawbar_N", "torque_N_m"))
    print(f"mean size                    {next(means):.2f}  {next(means):.2f}")
    if words:
        draw(runs, predictions).savefig(words[0], dpi=150)


if __name__ == "__main__":
    main(sys.argv[1:])
