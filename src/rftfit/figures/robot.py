"""The robot: speed against stride frequency and curvature, and its motion in a stride."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.figures import captions, style
from rftfit.figures.leg_panels import PROFILE_TITLES
from rftfit.figures.registry import figure, greek, only_if

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import pandas as pd
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.results import Results

    _Draw = Callable[[Results, str], Figure]

FREQUENCY_LABEL = "stride frequency (Hz)"
CURVATURE_LABEL = r"leg curvature $R'/r$"
SPEED_LABEL = "speed (cm/s)"

SWEEPS = ("robot", "robot_full")
"""Folders of the sweep of every run and of the full one (``rftfit sweep``)."""


def sweep_figure(name: str, reads: Sequence[str], **facts: Any) -> Callable[[_Draw], _Draw]:
    """Declare a figure that is drawn for each of `SWEEPS`; `reads` are tables of its folder."""

    def declare(draw: _Draw) -> _Draw:
        for sweep in SWEEPS:
            inside = figure(
                f"{{medium}}_{name}",
                reads=tuple(f"{{medium}}/{table}" for table in reads),
                media=lambda campaign, sweep=sweep: (sweep,) if campaign.robot_medium else (),
                group=f"{sweep}_figures",
                section="Robot",
                **facts,
            )(draw)
        return inside

    return declare


def leg_name(curvature: float) -> str:
    """Name of a leg by its curvature, R'/r."""
    names = {1.0: "c-leg", 0.0: "flat leg", -1.0: "reversed c-leg"}
    return names.get(curvature, f"R'/r = {style.number(curvature, 2)}")


# Speed against stride frequency


_MARKERS = "osD^vP*X<>"
_BACK, _FLAT, _AHEAD = ("#0B3C6F", "#9CC9EA"), "#444444", ("#F2B27A", "#9E2A00")
_LEFT_CM, _GAP_CM, _TOP_CM, _FOOT_CM = 1.25, 0.35, 0.75, 1.15


def _speed_numbers(results: Results, sweep: str) -> dict[str, str]:
    from rftfit.robot.speeds import share_within

    errors, runs = results.table(f"{sweep}/errors.csv"), results.table(f"{sweep}/speed.csv")
    told = {}
    for name, part in errors.groupby("profile", sort=False):
        (near, of), (far, _) = (share_within(part, percent) for percent in (20, 35))
        half = (part["simulated_hi_cm_per_s"] - part["simulated_lo_cm_per_s"]) / 2
        new = part[part["calibrated"] == "no"]
        (new_near, new_of), (new_far, _) = (share_within(new, percent) for percent in (20, 35))
        told[str(name)] = (
            f"{captions.name_of(str(name))}: within 20 % in {near} and within 35 % in {far} of {of} conditions; "
            f"of the {new_of} that the robot's unknown lengths were not found from, in {new_near} and "
            f"{new_far}"
        )
        if half.notna().any():
            median, most = (captions.quantile(half, share, 2) for share in (0.5, 1))
            told[str(name)] += f"; intervals of \N{PLUS-MINUS SIGN} {median} cm/s in the median, "
            told[str(name)] += f"at most \N{PLUS-MINUS SIGN} {most} cm/s"
    once = errors.drop_duplicates("condition")
    return {
        "robot_medium": results.campaign.titles[results.campaign.robot_medium],
        "conditions": str(len(once)),
        "calibrated": str(int((once["calibrated"] == "yes").sum())),
        "runs": str(len(runs)),
        "not_steady": str(int((runs["outcome"] != "steady").sum())),
        "warned": str(int((runs["warning"] != "").sum())),
        "table": told.get("table", ""),
        "profiles": ". ".join(told.values()),
    }


@sweep_figure(
    "speed",
    reads=("speed.csv", "errors.csv"),
    paper="Fig. 4C",
    caption="""The robot's speed against stride frequency for legs of several curvatures.
Measured on {robot_medium}.
Lines are simulated with the measured table, points measured: mean and standard deviation of trials.
Bars are {level} intervals of the simulated speed that follow from those of alpha. They hold neither the robot's \
unknown lengths nor what the model leaves out.
Hollow points ({calibrated} of {conditions}) are those that the lengths were found from.
Good: lines through the filled points.
Simulated on the {table}.""",
    numbers=_speed_numbers,
)
def speed(results: Results, sweep: str) -> Figure:
    """Draw speed against stride frequency on the measured table."""
    speeds, errors = results.table(f"{sweep}/speed.csv"), results.table(f"{sweep}/errors.csv")
    return draw_speeds(speeds, errors, ["table"])


@sweep_figure(
    "profiles",
    reads=("speed.csv", "errors.csv"),
    paper="Fig. S13",
    caption="""The robot's speed against stride frequency by every force profile.
Of {runs} runs, {not_steady} came to no steady speed and are not drawn; {warned} have leg tips faster than \
resistive forces are known to hold.
By profile: {profiles}.""",
    numbers=_speed_numbers,
)
def profiles(results: Results, sweep: str) -> Figure:
    """Draw speed against stride frequency, one panel a profile."""
    return draw_speeds(results.table(f"{sweep}/speed.csv"), results.table(f"{sweep}/errors.csv"))


def curvature_looks(curvatures: Sequence[float]) -> dict[float, tuple[str, str]]:
    """Colour and marker of each curvature: blue for reversed legs, red for c-legs, dark where strong."""
    from matplotlib.colors import LinearSegmentedColormap, to_hex

    ordered = sorted(set(curvatures))
    back = [one for one in ordered if one < 0]
    ahead = [one for one in ordered if one > 0]
    colours: dict[float, str] = dict.fromkeys([one for one in ordered if one == 0], _FLAT)
    for part, ends in ((back, _BACK), (ahead, _AHEAD)):
        ramp = LinearSegmentedColormap.from_list("", ends)
        places = np.linspace(0, 1, len(part)) if len(part) > 1 else [0.5]
        colours |= {one: to_hex(ramp(at)) for one, at in zip(part, places, strict=True)}
    return {one: (colours[one], _MARKERS[i % len(_MARKERS)]) for i, one in enumerate(ordered)}


@style.styled
def draw_speeds(
    speed: pd.DataFrame, errors: pd.DataFrame, profiles: Sequence[str] | None = None
) -> Figure:
    """Draw speed against stride frequency, one panel a profile; default: all of the tables.

    Without any measured condition in `errors` model curves alone are drawn, at the ends and the
    middle of the curvatures.
    """
    names = list(profiles or dict.fromkeys(speed["profile"]))
    if speed.empty:
        return style.missing("there is no simulated speed to draw")
    shown = sorted(set(errors["curvature_times_R"]) or {-1.0, 0.0, 1.0})
    looks = curvature_looks(shown)
    single = len(names) == 1
    panel = (
        6.6
        if single
        else (style.DOUBLE_CM - _LEFT_CM - 0.2 - (len(names) - 1) * _GAP_CM) / len(names)
    )
    width = _LEFT_CM + len(names) * panel + (len(names) - 1) * _GAP_CM + 0.2
    height = 5.4 if single else 6.2
    page = style.new_figure(width, _TOP_CM + height + _FOOT_CM + (1.55 if single else 1.25))
    drawn = speed[speed["profile"].isin(names)]
    # where no run was steady, zero stands in for the speeds
    highest = [drawn["speed_cm_per_s"].max(), errors["measured_cm_per_s"].max()]
    lowest = float(np.nan_to_num(drawn["speed_cm_per_s"].min()))
    top = float(np.nan_to_num(highest).max() * 1.06) or 1.0
    for column, name in enumerate(names):
        left = _LEFT_CM + column * (panel + _GAP_CM)
        axes = style.axes_cm(page, left, _TOP_CM, panel, height)
        part = errors[errors["profile"] == name]
        _speed_panel(axes, speed[speed["profile"] == name], part, looks)
        axes.set_xlim(0, 5.15)
        axes.set_ylim(min(0.0, lowest * 1.05), top)
        axes.set_xlabel(FREQUENCY_LABEL)
        axes.set_title(f"{PROFILE_TITLES.get(name, style.plain(name))}", loc="left", fontsize=7.5)
        axes.text(0.03, 0.97, _shares(part), transform=axes.transAxes, va="top", fontsize=6)
        if column == 0:
            axes.set_ylabel(SPEED_LABEL)
        else:
            axes.tick_params(labelleft=False)
    _speed_legend(page, looks, not errors.empty, 4 if single else len(looks))
    return page


def _speed_panel(
    axes: Axes, speed: pd.DataFrame, errors: pd.DataFrame, looks: dict[float, tuple[str, str]]
) -> None:
    for curvature, (colour, marker) in looks.items():
        rows = speed[np.isclose(speed["curvature_times_R"], curvature)]
        mean = rows.groupby("frequency_Hz")["speed_cm_per_s"].mean()
        x, y = mean.index.to_numpy(float), mean.to_numpy(float)
        if x.size and x[0] > 0:
            # legs at rest, robot at rest
            x, y = np.append(0.0, x), np.append(0.0, y)
        axes.plot(x, y, color=colour, linewidth=1.0, zorder=2)
        own = errors[np.isclose(errors["curvature_times_R"], curvature)]
        ends = own["simulated_lo_cm_per_s"], own["simulated_hi_cm_per_s"]
        axes.vlines(own["frequency_Hz"], *ends, color=colour, linewidth=3.2, alpha=0.35, zorder=1.5)
        for told, fill in (("no", colour), ("yes", "white")):
            points = own[own["calibrated"] == told]
            axes.errorbar(
                points["frequency_Hz"], points["measured_cm_per_s"],
                yerr=points["measured_sd_cm_per_s"].fillna(0), fmt=marker, color=colour,
                markersize=3.4, markerfacecolor=fill, markeredgewidth=0.7, elinewidth=0.6,
                capsize=1.2, zorder=3,
            )  # fmt: skip


def _shares(errors: pd.DataFrame) -> str:
    from rftfit.robot.speeds import share_within

    lines = []
    for percent in (20, 35):
        within, total = share_within(errors, percent)
        if total:
            lines.append(f"within {percent} %: {within} of {total}")
    return "\n".join(lines)


def _speed_legend(
    figure: Figure, looks: dict[float, tuple[str, str]], measured: bool, across: int
) -> None:
    # shown with the marker where there is one
    entries = {
        style.number(one, 2): style.line(colour, marker=marker if measured else "", markersize=3.4)
        for one, (colour, marker) in looks.items()
    }
    style.legend(
        figure, entries, across, title=CURVATURE_LABEL, bbox_to_anchor=(0.5, 0.06), title_fontsize=6.5,
        handlelength=1.8, columnspacing=1.0, borderaxespad=0.5,
    )  # fmt: skip
    note = "lines: simulated"
    if measured:
        note += ", bars: interval that follows from alpha's"
        break_at = "\n" if across < len(looks) else "; "
        note += f"{break_at}points: measured (mean and s.d. of trials)"
        break_at = "\n" if across < len(looks) else ", "
        note += f"{break_at}hollow where the robot was calibrated on them"
    height = float(figure.get_size_inches()[1]) / style.CM
    style.text_cm(figure, 0.2, height - 0.12, note, fontsize=5.5, va="bottom")


# Speed against curvature


def _curvature_numbers(results: Results, sweep: str) -> dict[str, str]:
    told = []
    for name, part in results.table(f"{sweep}/optimum.csv").groupby("profile", sort=False):
        top = part.iloc[int(part["frequency_Hz"].to_numpy(float).argmax())]
        reading = captions.span(top["reading_lo"], top["reading_hi"], 2)
        ends = captions.span(top["best_curvature_lo"], top["best_curvature_hi"], 3)
        told.append(
            f"{captions.name_of(str(name))}, {style.number(top['frequency_Hz'], 1)} Hz: fastest at R'/r "
            f"{style.number(top['best_curvature_times_R'], 2)} (read within {reading}"
            + (f"; interval from that of alpha {ends}" if ends else "")
            + f") with {style.number(top['speed_cm_per_s'], 1)} cm/s"
            + (", which the robot was calibrated on" if top["calibrated"] == "yes" else "")
        )
    return {"best": greek("; ".join(told))}


@sweep_figure(
    "curvature",
    reads=("speed.csv", "optimum.csv"),
    paper="Fig. 4D",
    caption="""Simulated speed over leg curvature R'/r (1: c-leg, 0: flat, -1: reversed c-leg) and stride frequency, \
with the fastest curvature at each frequency. Its bars are how far it can be read off the points of the sweep.
By profile: {best}.""",
    numbers=_curvature_numbers,
)
def curvature(results: Results, sweep: str) -> Figure:
    """Draw simulated speed over curvature and frequency, with the fastest curvature."""
    return draw_optimum(results.table(f"{sweep}/speed.csv"), results.table(f"{sweep}/optimum.csv"))


@style.styled
def draw_optimum(speed: pd.DataFrame, optimum: pd.DataFrame, profile: str = "table") -> Figure:
    """Draw simulated speed over curvature and frequency, with the fastest curvature, on a profile."""
    own = speed[speed["profile"] == profile]
    best = optimum[optimum["profile"] == profile].sort_values("frequency_Hz")
    frequencies = best["frequency_Hz"].to_numpy(float)
    grid = own[np.isin(own["frequency_Hz"], frequencies)]
    table = grid.pivot_table(
        index="frequency_Hz", columns="curvature_times_R", values="speed_cm_per_s"
    )
    if table.empty:
        reasons = own["reason"].value_counts()
        why = str(reasons.index[0]) if len(reasons) else "no run of the sweep"
        return style.missing(
            f"{captions.name_of(profile)}: no run of the sweep has a steady speed", [why]
        )
    page = style.new_figure(style.DOUBLE_CM, 7.9)
    left = style.axes_cm(page, 1.25, 0.75, 6.4, 6.1)
    whole = table.dropna(axis="columns")
    image = left.pcolormesh(
        whole.columns.to_numpy(float), whole.index.to_numpy(float), whole.to_numpy(float),
        cmap=style.SEQUENTIAL, shading="nearest", vmin=0,
    )  # fmt: skip
    low = (best["best_curvature_times_R"] - best["reading_lo"]).clip(lower=0)
    high = (best["reading_hi"] - best["best_curvature_times_R"]).clip(lower=0)
    left.errorbar(
        best["best_curvature_times_R"], frequencies, xerr=[low, high], fmt="o-", color="white",
        markersize=3, linewidth=0.8, elinewidth=0.8, capsize=1.5, markeredgecolor="black",
        markeredgewidth=0.4,
    )  # fmt: skip
    left.set_xlim(-1.04, 1.04)
    left.set_xlabel(CURVATURE_LABEL)
    left.set_ylabel(FREQUENCY_LABEL)
    left.set_title(
        "fastest curvature at each frequency, as far as it can be read", loc="left", fontsize=6.5
    )
    bar = style.axes_cm(page, 7.85, 0.75, 0.3, 6.1)
    page.colorbar(image, cax=bar, label=SPEED_LABEL)
    right = style.axes_cm(page, 10.9, 0.75, 7.2, 6.1)
    _curves(right, grid, best)
    return page


def _curves(axes: Axes, grid: pd.DataFrame, best: pd.DataFrame) -> None:
    from matplotlib import colormaps

    frequencies = best["frequency_Hz"].to_numpy(float)
    wanted = frequencies[:: max(1, len(frequencies) // 6)] if len(frequencies) > 8 else frequencies
    if frequencies.size and frequencies[-1] not in wanted:
        wanted = np.append(wanted, frequencies[-1])
    ramp = colormaps[style.SEQUENTIAL]
    for at, frequency in enumerate(wanted):
        colour = ramp(0.05 + 0.85 * at / max(1, len(wanted) - 1))
        mean = (
            grid[grid["frequency_Hz"] == frequency]
            .groupby("curvature_times_R")["speed_cm_per_s"]
            .mean()
        )
        axes.plot(mean.index, mean, "-", color=colour, linewidth=1, marker=".", markersize=2.5)
        axes.annotate(
            f"{frequency:g} Hz", (1.0, float(mean.iloc[-1])), textcoords="offset points",
            xytext=(4, 0), va="center", fontsize=6, color=colour, annotation_clip=False,
        )  # fmt: skip
        top = best[best["frequency_Hz"] == frequency].iloc[0]
        axes.plot(
            top["best_curvature_times_R"], top["speed_cm_per_s"], "o", color=colour, markersize=4,
            markeredgecolor="black", markeredgewidth=0.5, zorder=4,
        )  # fmt: skip
    axes.set_xlim(-1.04, 1.3)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.set_xticks(np.arange(-1, 1.01, 0.5))
    axes.set_xlabel(CURVATURE_LABEL)
    axes.set_ylabel(SPEED_LABEL)
    axes.set_title("simulated; circles: fastest curvature", loc="left", fontsize=6.5)


# Motion and forces in a stride


_MOTION_LEFT_CM, _MOTION_TOP_CM, _MOTION_FOOT_CM = 1.6, 0.95, 0.6
_PANEL_CM, _PITCH_CM = 2.6, 2.95

_KINEMATICS = (
    ("velocity_x_cm_per_s", "forward velocity\n(cm/s)"),
    ("z_cm", "height\n(cm)"),
    ("pitch_deg", "pitch, nose up\n(deg)"),
)
_PROFILE_LOOKS = {
    "table": (style.OKABE_ITO["blue"], "-"),
    "map": (style.OKABE_ITO["orange"], (0, (6, 1))),
    "generic": (style.OKABE_ITO["reddish purple"], (0, (5, 1.2, 1, 1.2))),
    "depth_only": (style.OKABE_ITO["bluish green"], (0, (1.5, 1))),
}
_GROUPS = (
    *(style.OKABE_ITO[name] for name in ("blue", "vermillion", "bluish green")), "#888888",
    *(style.OKABE_ITO[name] for name in ("yellow", "sky blue")),
)  # fmt: skip
"""Colours of the groups of elements."""


def _stride_numbers(results: Results, medium: str) -> dict[str, str]:  # noqa: ARG001
    motion, told = results.table("robot/motion.csv"), {}
    for _, part in motion.groupby(["profile", "curvature_times_R"], sort=False):
        profile, curvature = str(part["profile"].iloc[0]), float(part["curvature_times_R"].iloc[0])
        rise, pitch = (np.ptp(part[name].to_numpy(float)) for name in ("z_cm", "pitch_deg"))
        told[profile, curvature] = (
            f"{captions.name_of(profile)}, {leg_name(curvature)} at {part['frequency_Hz'].iloc[0]:.1f} Hz: "
            f"{style.number(_mean_speed(part), 1)} cm/s, height within {style.number(rise, 2)} cm, pitch "
            f"within {style.number(pitch, 1)} degrees, lift of a tripod up to "
            f"{style.number(part['force_z_tripod_1_N'].max(), 2)} N"
        )
    own = [text for (profile, _), text in told.items() if profile == "table"]
    return {"strides": "; ".join(own), "every": "; ".join(told.values())}


_MOTION: dict[str, Any] = {
    "reads": ("robot/motion.csv",),
    "media": only_if(lambda campaign: campaign.robot_medium),
    "group": "robot_figures",
    "section": "Robot",
    "numbers": _stride_numbers,
}


@figure(
    "robot_motion",
    paper="Fig. 4B",
    caption="""The robot's forward velocity, height and pitch over two strides, and the forces of the medium on both \
tripods and on its plates, simulated on the measured table. Dashed: the mean speed.
Good: the second stride repeats the first, and the tripods carry the body in turn.
In numbers: {strides}.""",
    **_MOTION,
)
def robot_motion(results: Results) -> Figure:
    """Draw motion and forces over two strides on the measured table."""
    return draw_motion(results.table("robot/motion.csv"))


@figure(
    "robot_reaction",
    paper="Fig. S14",
    caption="""Lift and thrust of one tripod, and the robot's velocity, over two strides, by every force profile.
In numbers: {every}.""",
    **_MOTION,
)
def robot_reaction(results: Results) -> Figure:
    """Draw lift and thrust of the first tripod by every profile."""
    motion = results.table("robot/motion.csv")
    curvatures = sorted(set(motion["curvature_times_R"]), reverse=True)
    names = list(dict.fromkeys(motion["profile"]))
    page, panels = _panels(len(curvatures), 3)
    quantities = (
        ("force_z_tripod_1_N", "lift of a tripod\n(N)"),
        ("force_x_tripod_1_N", "thrust of a tripod\n(N)"),
        ("velocity_x_cm_per_s", "forward velocity\n(cm/s)"),
    )
    for column, curvature in enumerate(curvatures):
        for profile in names:
            chosen = (motion["curvature_times_R"] == curvature) & (motion["profile"] == profile)
            part = motion[chosen].sort_values("stride")
            colour, line = _PROFILE_LOOKS.get(profile, ("black", "-"))
            for row, (name, label) in enumerate(quantities):
                axes = panels[row][column]
                axes.plot(part["stride"], part[name], color=colour, linestyle=line, linewidth=1)
                axes.axhline(0, color="black", linewidth=0.4)
                if column == 0:
                    axes.set_ylabel(label)
        frequency = motion["frequency_Hz"].iloc[0]
        panels[0][column].set_title(f"{leg_name(curvature)}, {frequency:g} Hz", fontsize=7)
    _share_ranges(panels)
    looks = {name: _PROFILE_LOOKS.get(name, ("black", "-")) for name in names}
    entries = {
        PROFILE_TITLES.get(name, name): style.line(colour, linestyle=line)
        for name, (colour, line) in looks.items()
    }
    _legend(page, entries)
    return page


@style.styled
def draw_motion(motion: pd.DataFrame, profile: str = "table") -> Figure:
    """Draw forward velocity, height, pitch, lift and thrust over two strides on a profile.

    `motion`: ``profile, curvature_times_R, frequency_Hz, stride``, and the columns of
    `rftfit.robot.run.Series.table`.
    """
    own = motion[motion["profile"] == profile]
    curvatures = sorted(set(own["curvature_times_R"]), reverse=True)
    rows = len(_KINEMATICS) + 2
    page, panels = _panels(len(curvatures), rows)
    groups = group_names(own)
    for column, curvature in enumerate(curvatures):
        part = own[own["curvature_times_R"] == curvature].sort_values("stride")
        stride = part["stride"].to_numpy(float)
        for row, (name, label) in enumerate(_KINEMATICS):
            axes = panels[row][column]
            axes.plot(stride, part[name], color="black", linewidth=1)
            if column == 0:
                axes.set_ylabel(label)
        mean = _mean_speed(part)
        panels[0][column].axhline(mean, color="#888888", linewidth=0.7, linestyle=(0, (4, 2)))
        panels[0][column].set_title(
            f"{leg_name(curvature)}, {part['frequency_Hz'].iloc[0]:g} Hz: {mean:.3g} cm/s",
            fontsize=7,
        )
        for row, component, label in (
            (rows - 2, "z", "lift by group\n(N)"),
            (rows - 1, "x", "thrust by group\n(N)"),
        ):
            axes = panels[row][column]
            for group, colour in zip(groups, _GROUPS, strict=False):
                axes.plot(stride, part[f"force_{component}_{group}_N"], color=colour, linewidth=0.9)
            axes.axhline(0, color="black", linewidth=0.4)
            if column == 0:
                axes.set_ylabel(label)
    _share_ranges(panels)
    looks = zip(groups, _GROUPS, strict=False)
    entries = {group.replace("_", " "): style.line(colour) for group, colour in looks}
    _legend(page, entries)
    return page


def group_names(motion: pd.DataFrame) -> list[str]:
    """Find the groups of elements in a table of motion: tripods first, then plates."""
    found = [
        name.removeprefix("force_z_").removesuffix("_N")
        for name in motion.columns
        if name.startswith("force_z_")
    ]
    return sorted(found, key=lambda name: (not name.startswith("tripod"), found.index(name)))


def _mean_speed(part: pd.DataFrame) -> float:
    time, x = part["time_s"].to_numpy(float), part["x_cm"].to_numpy(float)
    return float((x[-1] - x[0]) / (time[-1] - time[0]))


def _panels(columns: int, rows: int) -> tuple[Figure, list[list[Axes]]]:
    panel = (style.DOUBLE_CM - _MOTION_LEFT_CM - 0.2 - (columns - 1) * _GAP_CM) / columns
    panel = min(panel, 7.5)
    width = _MOTION_LEFT_CM + columns * panel + (columns - 1) * _GAP_CM + 0.2
    page = style.new_figure(width, _MOTION_TOP_CM + rows * _PITCH_CM + _MOTION_FOOT_CM)
    panels = []
    for row in range(rows):
        top = _MOTION_TOP_CM + row * _PITCH_CM
        lefts = [_MOTION_LEFT_CM + column * (panel + _GAP_CM) for column in range(columns)]
        line = [style.axes_cm(page, left, top, panel, _PANEL_CM) for left in lefts]
        for axes in line:
            axes.tick_params(labelbottom=row == rows - 1)
            axes.margins(x=0)
        line[0].yaxis.set_label_coords(-0.78 / panel, 0.5)
        panels.append(line)
    for axes in panels[-1]:
        axes.set_xlabel("strides")
    return page, panels


def _share_ranges(panels: list[list[Axes]]) -> None:
    """One range for each row, named at its left only."""
    for line in panels:
        ends = np.array([axes.get_ylim() for axes in line])
        for column, axes in enumerate(line):
            axes.set_ylim(ends[:, 0].min(), ends[:, 1].max())
            axes.tick_params(labelleft=column == 0)


def _legend(figure: Figure, entries: dict[str, Artist]) -> None:
    style.legend(
        figure, entries, len(entries), loc="upper center", columnspacing=2.0, borderaxespad=0.1
    )
