"""Picture of legs that were measured elsewhere: ``python docs/_ext/contact_picture.py`` writes it into ``docs/images``."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import pandas as pd
from PIL import Image

import rftfit
from rftfit.compare.bodies import published_body_error
from rftfit.figures import style
from rftfit.figures.leg_panels import THETA_LABEL, leg_title
from rftfit.reference import LEGS
from rftfit.reference import load as load_reference

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "images" / "contacts.webp"
SAND, ALPHA = "yuma", 0.692
"""Natural sand of Fig. S12, and alpha_z(0, 90 deg) of its penetration test, N/cm^3."""


def main() -> None:
    """Draw lift and thrust on the legs in a sand: measured, by one push, and with the legs' error from five media."""
    push = {
        "beta_deg": [0],
        "gamma_deg": [90],
        "alpha_z_N_per_cm3": [ALPHA],
        "se_z": [0.05 * ALPHA],
    }
    medium = rftfit.estimate_map(pd.DataFrame(push))
    curves = load_reference("fig_s12")
    with style.styled():
        page, panels = style.panels([4.2, 4.2], len(LEGS), 6.0)
        for column, leg in enumerate(LEGS):
            rows = curves[(curves["medium"] == SAND) & (curves["leg"] == leg)]
            theta = rows["theta_deg"].to_numpy(float)
            arguments = medium.profile, rftfit.model_leg(leg), rftfit.rotation(theta)
            plain = rftfit.predict(*arguments)
            learned = rftfit.predict(*arguments, body_error=published_body_error(leg))
            for axes, (c, label) in zip(
                panels[:, column], (("z", "lift (N)"), ("x", "thrust (N)")), strict=True
            ):
                for forces, colour in ((plain, "#999999"), (learned, style.OKABE_ITO["blue"])):
                    lo, hi = (forces[f"force_{c}_model_{end}_N"] for end in ("lo", "hi"))
                    axes.fill_between(theta, lo, hi, color=colour, alpha=0.2, linewidth=0)
                    axes.plot(theta, forces[f"force_{c}_N"], color=colour)
                axes.plot(theta, rows[f"force_{c}_N"], color="black", linestyle="--")
                axes.set(xlim=(-110, 110), ylabel="" if column else label)
                style.name_below(axes, THETA_LABEL, c == "x")
            panels[0, column].set_title(leg_title(leg), loc="left", weight="bold")
        style.legend(
            page,
            {
                "measured": style.line("black", linestyle="--"),
                "one push": style.line("#999999"),
                "one push, and the same leg in five other media": style.line(
                    style.OKABE_ITO["blue"]
                ),
                "95 % interval with the model's own error": style.patch(facecolor="#cccccc"),
            },
        )
        png = style.content(page, "png")
    picture = Image.open(BytesIO(png)).convert("RGB")
    size = 900, round(900 * picture.height / picture.width)
    picture.resize(size, Image.Resampling.LANCZOS).save(PICTURE, "webp", quality=70)


if __name__ == "__main__":
    main()
