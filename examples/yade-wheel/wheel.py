"""Drawbar and torque of a lugged wheel, from its load alone, beside its measured traction and its simulation.

``python examples/yade-wheel/wheel.py [--from DIR] [FIGURE.png]`` prints the table and draws the figure. Mesh, measured traction
and averages of the simulated runs are downloaded into the folder ``yade-wheel``, each checked against its sha256;
``--from`` names a folder that has them. They are under the GPL-3 and no part of this project.
"""

import sys
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

import rftfit
from rftfit.store.digests import read_sums, sha256_of

SOURCE = "https://github.com/Mississippi-State-University-OTM/Yade-DEM-Wheel-Soil-Simulator/raw/0a399180/"
SUMS = Path(__file__).with_name("files.sha256")
MESH = "meshes/wheelKyoto.stl"
TRACTION = "examples/Kyoto/Fig9ref.txt"
SLIPS = {  # by run, in percent
    "fSlip06p30_2p0kg": 6.30,
    "fSlip13p05_2p0kg": 13.05,
    "fSlip21p02_2p0kg": 21.02,
    "fSlip35p42_2p0kg": 35.42,
    "fSlip60p00_2p0kg": 60.00,
}
RADIUS_CM = 11.0  # over the lugs
EDGE_CM = 1.0  # the mesh has 284 triangles, some as long as the wheel is wide
SURFACE_CM = -19.68
"""Height of the surface before the run in the coordinates of the runs, where a lug first touches (time series)."""
CASES = {"rule": {}, "rule, friction 0.4": {"friction": 0.4}, "every face": {"track": False}}
COLOURS = ("#0072B2", "#009E73", "#D55E00", "#E69F00")


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
    """One row a slip: sinkage (cm) and load (N) of the simulation, drawbar (N) and torque (N cm) measured and simulated."""
    columns = ["slip", "net", "gross", "resistance"]
    traction = pd.read_csv(folder / TRACTION, sep=r"\s+", names=columns, header=0)
    traction = traction.set_index("slip")
    rows = []
    for run, percent in SLIPS.items():
        lines = (folder / "examples" / "Kyoto" / run / "avgs.txt").read_text().splitlines()
        means = {line.split()[0]: float(line.split()[1]) for line in lines if line[0] != "#"}
        rows.append(
            {
                "slip": percent / 100,
                "sinkage_cm": RADIUS_CM - (100 * means["z"] - SURFACE_CM),
                "load_N": means["Fz"],
                "drawbar_N": traction["net"][percent],
                "torque_N_cm": traction["gross"][percent] * RADIUS_CM,
                "simulated_drawbar_N": means["Fx"],
                "simulated_torque_N_cm": -100 * means["Ty"],
            }
        )
    return pd.DataFrame(rows).sort_values("slip", ignore_index=True)


def predict_runs(mesh, runs, **options):
    """Answer for all runs in a sand that carries the load at the height of the axle; its strength is not given."""
    slip, sinkage, load = (runs[name] for name in ("slip", "sinkage_cm", "load_N"))
    sand = rftfit.scale(1.0)
    return rftfit.wheel(sand, mesh, slip, sinkage_cm=sinkage, load_N=load, **options).table


def root_mean_square(errors):
    """Root mean square of some errors."""
    return float((errors**2).mean() ** 0.5)


def draw(runs, predictions):
    """Drawbar and torque over slip: points measured and simulated, lines predicted; the interval is that of the first."""
    page = Figure(figsize=(7.2, 3.4), layout="constrained")
    labels = {"drawbar_N": "drawbar (N)", "torque_N_cm": "torque of the drive (N cm)"}
    for axes, (name, label) in zip(page.subplots(1, 2), labels.items(), strict=True):
        axes.plot(100 * runs["slip"], runs[name], "ko", label="measured")
        axes.plot(100 * runs["slip"], runs[f"simulated_{name}"], "wo", mec="k", label="simulated")
        for (case, predicted), colour in zip(predictions.items(), COLOURS, strict=True):
            axes.plot(100 * runs["slip"], predicted[name], color=colour, label=case)
        quantity, _, unit = name.partition("_")
        first = next(iter(predictions.values()))
        ends = (first[f"{quantity}_model_{end}_{unit}"] for end in ("lo", "hi"))
        axes.fill_between(100 * runs["slip"], *ends, color=COLOURS[0], alpha=0.15, linewidth=0)
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
    lugged = rftfit.Mesh.read(folder / MESH, "m").refined(EDGE_CM)
    predictions = {case: predict_runs(lugged, runs, **options) for case, options in CASES.items()}
    cylinder = rftfit.Mesh.cylinder(RADIUS_CM, width_cm=10)
    predictions["plain cylinder"] = predict_runs(cylinder, runs)
    print(f"{len(runs)} runs, slip {100 * runs.slip.min():.0f} to {100 * runs.slip.max():.0f} %")
    print("rms error beside       measured: drawbar, N  torque, N m  simulated: drawbar, N")
    for case, predicted in predictions.items():
        names = ("drawbar_N", "torque_N_cm")
        drawbar, torque = (root_mean_square(predicted[n] - runs[n]) for n in names)
        simulated = root_mean_square(predicted["drawbar_N"] - runs["simulated_drawbar_N"])
        print(f"{case:28} {drawbar:15.2f} {torque / 100:12.2f} {simulated:22.2f}")
    off = root_mean_square(runs["simulated_drawbar_N"] - runs["drawbar_N"])
    print(f"the simulation itself        {off:15.2f}")
    means = [runs[name].abs().mean() for name in ("drawbar_N", "torque_N_cm")]
    print(f"mean size                    {means[0]:15.2f} {means[1] / 100:12.2f}")
    if words:
        draw(runs, predictions).savefig(words[0], dpi=150)


if __name__ == "__main__":
    main(sys.argv[1:])
