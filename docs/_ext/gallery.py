"""What the site shows of campaigns: ``make gallery`` runs them into ``docs/_campaigns`` and writes what the repository keeps.

Written are the drawings, the picture of the README and ``docs/gallery.md`` with their pictures in ``docs/images``,
``docs/live/report.html``, the page of verdicts ``docs/validation.md``, and below the commands of the pages what they print.

python docs/_ext/gallery.py [DATA]      DATA: folder of the examples' data, which are downloaded otherwise
"""

from __future__ import annotations

import inspect
import re
import shutil
import subprocess
import sys
import tempfile
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import drawings
import pandas as pd
import quality_sheets
import readme_picture
from PIL import Image

import rftfit
from rftfit.figures.registry import DeclaredFigure, figures
from rftfit.figures.style import content
from rftfit.figures.verdicts import draw_verdicts
from rftfit.suite.declared import DOMAINS, find_example, list_examples
from rftfit.suite.files import RAW
from rftfit.suite.page import describe, tabulate_compared
from rftfit.suite.verdicts import FILE as VERDICTS_FILE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rftfit.results import Results
    from rftfit.suite.declared import Example
    from rftfit.suite.page import PageBlock

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
CAMPAIGNS = DOCS / "_campaigns"
PICTURES = DOCS / "images" / "gallery"
SHOWN = {
    "demonstration": "the demonstration",
    "cmu-sand": "the [sand example](example-cmu-sand.md)",
}
HEAD = """# Gallery

Every figure that `rftfit run` draws, with its caption, the command that makes it and the call in Python. A
<a href="live/report.html">live report</a> shows how they stand together. `make gallery` writes this page.
"""
SPACE = """
## Bodies in space

### A wheel along its path

![forces on a wheel over time, and the wheel coloured by stress](images/space_path.webp)

Shaded, the interval; dashed, the error of the law in space. Colour is the stress on faces that push into the medium. Good: the shade is narrower than the question needs.

From [a wheel, or any body in space](howto/space.md): `rftfit predict --mesh wheel.stl --unit mm --path path.csv --alpha 0.35 --figure wheel.png`.

### A rover in MuJoCo

![a rover with four wheels in sand](images/space_rover.webp)

Any MuJoCo model on a measured medium. Good: at rest it does not creep.

From [a robot in MuJoCo](howto/mujoco.md): `rftfit.mujoco.attach(model, data, medium)`. `python docs/_ext/space_pictures.py` draws both.

## A leg that was measured elsewhere

![lift and thrust on three legs in a natural sand, measured and predicted](images/contacts.webp)

Three legs in a natural sand that is known by one push. Grey: by the map of that push; blue: with what the model got wrong on the same leg in five other media. Good: blue near the dashed measurement, which lies inside the shade.

From [every contact is a measurement](theory/contacts.md): `rftfit predict --leg c_leg --alpha 0.69 --body-of published`. `python docs/_ext/contact_picture.py` draws it.
"""


def config_of_demonstration() -> str:
    """Configuration of the demonstration."""
    return (ROOT / "config" / "config.yaml").read_text(encoding="utf-8")


def config_of_report() -> str:
    """The demonstration with loose poppy seeds alone, and without the robot."""
    text = config_of_demonstration().partition("\nrobot:")[0] + "\n"
    text = re.sub(r"\n  (?!poppy_LP)[\w.]+: \{title: .*", "", text)
    return re.sub(
        r"(?m)^title: .*", "title: Plates and legs in loose poppy seeds (simulated)", text
    )


def config_of_tutorial() -> str:
    """Configuration of the tutorial's campaign, from its page."""
    page = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    return page.partition("<!-- file: config/config.yaml -->\n```yaml\n")[2].partition("```")[0]


def command(folder: Path, *words: str) -> None:
    """Call ``rftfit`` in a folder."""
    print(f"{folder.name}: rftfit {' '.join(words)}", flush=True)  # noqa: T201
    subprocess.run([Path(sys.executable).with_name("rftfit"), *words], cwd=folder, check=True)


def run_campaigns(data: str | None) -> None:
    """Make the campaigns; what is up to date stays."""
    configs = {
        "demonstration": config_of_demonstration(),
        "report": config_of_report(),
        "tutorial": config_of_tutorial(),
    }
    for name, text in configs.items():
        (CAMPAIGNS / name / "config").mkdir(parents=True, exist_ok=True)
        (CAMPAIGNS / name / "config" / "config.yaml").write_text(text, encoding="utf-8")
        command(CAMPAIGNS / name, "reenact", "--if-missing")
        command(CAMPAIGNS / name, "run")
    for name in list_examples():
        origin = ["--from", data] if data else []
        command(CAMPAIGNS, "example", name, folder_of_example(name), *origin)


def folder_of_example(name: str) -> str:
    """Folder in which an example is run: the demonstration is that of the paper."""
    return "demonstration" if name == "paper" else name


ALL_VERDICTS = """
## Every row that was compared

[All rows](tables/verdicts.csv): what, published, ours, verdict and reason, written by `make gallery`; the folder of an example has its
own in `verdicts.html`.
"""


def write_verdicts() -> None:
    """Write the page of all verdicts with its figure, from what the examples left."""
    examples = [find_example(name) for name in list_examples()]
    tables = [
        pd.read_csv(CAMPAIGNS / folder_of_example(example.name) / VERDICTS_FILE)
        for example in examples
    ]
    verdicts = pd.concat(tables, ignore_index=True).sort_values(
        "domain", key=lambda names: names.map(DOMAINS.index), kind="stable"
    )
    picture = Image.open(BytesIO(content(draw_verdicts(verdicts), "png"))).convert("RGB")
    picture.save(DOCS / "images" / "verdicts.webp", "webp", quality=80)
    page = as_markdown(describe(examples, verdicts, is_public=True), "images/verdicts.webp")
    rows = tabulate_compared(examples, without_private_numbers(examples, verdicts))
    rows.to_csv(DOCS / "tables" / "verdicts.csv", index=False)
    (DOCS / "validation.md").write_text(page + ALL_VERDICTS, encoding="utf-8")


def without_private_numbers(examples: Sequence[Example], verdicts: pd.DataFrame) -> pd.DataFrame:
    """Replace the numbers of files that may not be shipped by words."""
    private = {
        (example.name, f"{RAW}/{file.name}")
        for example in examples
        for file in example.settings.files
        if not file.may_be_shipped
    }
    files = zip(verdicts["example"], verdicts["from_file"], strict=True)
    is_private = [example_and_file in private for example_and_file in files]
    shown = verdicts.astype({"published": object, "ours": object})
    shown.loc[is_private, ["published", "ours"]] = "in the file, which has no licence to show it"
    # the reason states the difference of both numbers, which would give the published one away
    difference = r"lies [\d.e+-]+ .*? (above|below) ours; [^;]*"
    reasons = shown.loc[is_private, "reason"]
    shown.loc[is_private, "reason"] = reasons.str.replace(difference, r"lies \1 ours", regex=True)
    return shown


def as_markdown(blocks: Iterator[PageBlock], picture: str) -> str:
    """Format the blocks of the page of verdicts as Markdown; `picture`: path of the figure."""
    parts = []
    for block in blocks:
        if block.header:
            lines = [block.header, ["---"] * len(block.header), *block.rows]
            parts.append("\n".join(f"| {' | '.join(map(plain_cell, cells))} |" for cells in lines))
        elif block.level:
            parts.append(f"{'#' * block.level} {block.text}")
        elif block.text:
            parts.append(block.text)
        else:
            parts.append(f"![published numbers against ours, by quantity]({picture})")
    return "\n\n".join(parts) + "\n"


def plain_cell(cell: str) -> str:
    """Return the text of a cell on one line, with a backslash before characters that mean something in Markdown."""
    return re.sub(r"([|*_<>\[\]`$])", r"\\\1", " ".join(cell.split()))


def write_gallery() -> None:
    """Write the page with its pictures: each figure from the first campaign that has it, for its first medium."""
    shutil.rmtree(PICTURES, ignore_errors=True)
    PICTURES.mkdir(parents=True)
    campaigns = {name: rftfit.open(CAMPAIGNS / name) for name in SHOWN}
    text, section = HEAD, ""
    for figure in declared():
        if figure.section != section:
            section = figure.section
            text += f"\n## {'First screen' if section == 'summary' else section}\n"
        text += _entry(figure, campaigns)
    text += SPACE
    (DOCS / "gallery.md").write_text(text, encoding="utf-8")
    source = CAMPAIGNS / "tutorial" / "results" / "figures" / "penetration.webp"
    shutil.copyfile(source, PICTURES / "tutorial_penetration.webp")


def declared() -> list[DeclaredFigure]:
    """Each figure once, by section: those of the robot are declared again for the full sweep."""
    shown = [figure for figure in figures() if not figure.on_demand]
    sections = list(dict.fromkeys(figure.section for figure in shown))
    return sorted(shown, key=lambda figure: sections.index(figure.section))


def name_of(figure: DeclaredFigure) -> str:
    """Name of a figure's files."""
    return figure.file("<medium>" if "medium" in _arguments(figure) else "")


def _arguments(figure: DeclaredFigure) -> list[str]:
    return list(inspect.signature(figure.draw).parameters)[1:]


def _entry(figure: DeclaredFigure, campaigns: dict[str, Results]) -> str:
    for name, results in campaigns.items():
        for medium in figure.media(results.campaign)[:1]:
            file = figure.file(medium)
            source = CAMPAIGNS / name / "results" / f"{file}.webp"
            shutil.copyfile(source, PICTURES / source.name)
            call = ", ".join(['rftfit.open(".")', *([f'"{medium}"'] if _arguments(figure) else [])])
            return f"""
### `{name_of(figure)}`

![{name_of(figure)}](images/gallery/{source.name})

{_plain(figure.caption_of(results, medium))}

From {SHOWN[name]}: `rftfit run results/{file}.png`, or `rftfit.figures.{figure.module}.{figure.draw.__name__}({call})`.
"""
    raise LookupError(f"no campaign of the gallery has {figure.run}")


def _plain(caption: str) -> str:
    return re.sub(r"([*_<$\[\]`|])", r"\\\1", escape(caption, quote=False))


def write_report() -> None:
    """Keep the report of loose poppy seeds, without links to files that stand beside it."""
    page = (CAMPAIGNS / "report" / "results" / "report.html").read_text(encoding="utf-8")
    link = r'<a href="(?![a-z]+:|#)[^"]*"[^>]*>'
    page = re.sub(rf"{link}(<img[^>]*>)</a>", r"\1", page)
    page = re.sub(rf" ?{link}[^<]*</a>", "", page)
    (DOCS / "live").mkdir(exist_ok=True)
    (DOCS / "live" / "report.html").write_text(page, encoding="utf-8")


def write_outputs() -> None:
    """Follow the pages that show what their commands print, and write what has changed."""
    sys.path.insert(0, str(ROOT / "tests" / "helpers"))
    from pages import Reader, blocks_of, comparable, fate, pages, without_progress

    for page in pages():
        blocks = blocks_of(page)
        if not any("output" in block.marks for block in blocks):
            continue
        lines = (ROOT / page).read_text(encoding="utf-8").splitlines()
        with tempfile.TemporaryDirectory() as folder:
            reader, printed = Reader(Path(folder)), {}
            for block in blocks:
                if fate(block) in ("run", "file"):
                    reader.follow(block)
                elif "output" in block.marks and comparable(block.text) != comparable(
                    reader.printed
                ):
                    printed[block.line] = without_progress(reader.printed)
        for start, text in reversed(printed.items()):
            lines[start : lines.index("```", start)] = [text]
        (ROOT / page).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    run_campaigns(str(Path(sys.argv[1]).resolve()) if sys.argv[1:] else None)
    drawings.write(DOCS / "images")
    quality_sheets.write(DOCS / "images")
    write_gallery()
    write_report()
    write_verdicts()
    sys.stdout.write(readme_picture.write(CAMPAIGNS / "cmu-sand") + "\n")
    write_outputs()
