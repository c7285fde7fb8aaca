"""`rftfit scale --contacts` estimates alpha from forces measured on a leg, or says why it cannot.

Also tested: `rftfit predict --body-of`, which corrects a prediction by what the model gets wrong
on a body that was measured before.
"""

import json
from typing import Any

import numpy as np
import pytest

import rftfit as program

pytestmark = pytest.mark.usefixtures("work_folder")


def curve(medium="glass0.3mm_CP", leg="c_leg", step=6):
    rows = program.published_table("fig_s5")
    rows = rows[(rows["medium"] == medium) & (rows["leg"] == leg)]
    rows = rows[rows["theta_deg"].abs() <= 110].iloc[::step]
    return rows[["theta_deg", "force_z_N", "force_x_N"]].assign(error_N=0.3)


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("theta_deg,force_z_N\n0,1\n", "--leg c_leg", "never moves"),
        ("theta_deg\n0\n10\n", "--leg c_leg", "no force was measured"),
        ("force_z_N\n1\n2\n", "--leg c_leg", "no pose of c_leg"),
        ("theta_deg,force_z_N\n0,1\n,2\n", "--leg c_leg", "blank"),
        ("theta_deg,force_z_N\n0,1\n30,x\n", "--leg c_leg", "force_z_N"),
        ("theta_deg,force_z_N\n0,1\n30,2\n20,1\n", "--leg c_leg", "turns back by 10"),
        ("theta_deg,force_z_N,hip_cm\n0,1,9\n30,2,9\n", "--leg c_leg", "in the air"),
        ("theta_deg,force_z_N,error_N\n0,1,0\n30,2,1\n", "--leg c_leg", "error_N"),
        ("theta_deg,force_z_N\n0,-1\n30,-2\n", "--leg c_leg", "meet no resistance"),
        ("theta_deg,force_z_N\n0,1\n30,2\n", "--body-of published", "needs --leg"),
        ("theta_deg,force_z_N\n0,1\n30,2\n", "--leg c_leg --profile generic", "map"),
    ],
)
def test_what_tells_nothing_is_a_word_and_no_number(rftfit, work_folder, text, options, words):
    (work_folder / "turn.csv").write_text(text)
    output = rftfit("scale --contacts turn.csv", options, code=2)
    assert words in output.err
    assert "alpha_z" not in output.out
    assert not (work_folder / "alpha.csv").exists()


def test_options_of_a_body_need_a_file(refusal):
    assert "--contacts" in refusal("scale --alpha 0.3 --leg c_leg")


def test_a_path_and_a_mesh_are_read_too(rftfit, work_folder):
    """A foot of 4 cm^2 that bears 2 N for each cm of depth: alpha straight down is 0.5 N/cm^3."""
    trimesh: Any = pytest.importorskip("trimesh")
    z = np.linspace(0, -3, 7)
    force = -2.0 * z
    lines = ["contact,t_s,x_cm,z_cm,angle_deg,force_z_N"]
    lines += [f"{name},{t},0,{z[t]:.3f},0,{force[t]:.3f}" for name in "ab" for t in range(7)]
    (work_folder / "press.csv").write_text("\n".join(lines))
    (work_folder / "foot.csv").write_text("x_cm,z_cm\n-1,0\n1,0\n")
    of_path = rftfit("scale --contacts press.csv --outline foot.csv --width 2 --json")
    assert "no error_N" in of_path.err
    lines = ["t_s,x_cm,y_cm,z_cm,turn_x_deg,turn_y_deg,turn_z_deg,force_z_N,error_N"]
    lines += [f"{t},0,0,{z[t]:.3f},0,0,0,{force[t]:.3f},0.1" for t in range(7)]
    (work_folder / "mesh.csv").write_text("\n".join(lines))
    trimesh.creation.box(extents=(2, 2, 0.02)).export(work_folder / "foot.obj")
    of_mesh = rftfit("scale --contacts mesh.csv --mesh foot.obj --unit cm --json --force")
    for output, count in ((of_path, 2), (of_mesh, 1)):
        answer = json.loads(output.out)
        assert answer["contacts"] == count
        assert answer["alpha_z_of_contacts"]["value"] == pytest.approx(0.5, rel=0.03)


def test_a_leg_of_the_paper_is_predicted_with_what_the_model_gets_wrong_on_it(rftfit):
    arguments = "predict --leg reversed_c_leg --medium glass3mm_CP --json"
    plain = json.loads(rftfit(arguments).out)
    carried = json.loads(rftfit(arguments, "--body-of published --force").out)
    assert "glass3mm_CP" in carried["body"]
    rows = curve("glass3mm_CP", "reversed_c_leg", 1)
    measured = rows["force_z_N"].max()
    tops = [facts["peaks"]["lift"]["force_z_N"] for facts in (plain, carried)]
    assert abs(tops[1] - measured) < 0.5 * abs(tops[0] - measured)
