"""Reference pages made from the program's own definitions when the site is built.

In a page, ``{generated} outputs`` in a fenced block stands for the text that is made; ``python docs/_ext/generated.py outputs``
prints it.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from api_page import api
from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from collections.abc import Callable

    from docutils import nodes
    from sphinx.application import Sphinx


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "".join(
        f"| {' | '.join(cell.replace('|', '&#124;') for cell in line)} |\n" for line in lines
    )


def outputs() -> str:
    """Every file that a run writes, with every column."""
    from rftfit.measure.ledger import RowStatus
    from rftfit.measure.sentences import SENTENCES
    from rftfit.outputs.dictionary import SECTIONS
    from rftfit.outputs.dictionary import outputs as described

    titles = {
        "measure": "From logs to alpha",
        "profile": "Profiles and scaling",
        "predict": "Forces on legs",
        "robot": "Robot",
        "run": "Ledger, record, page and figures",
        "commands": "Files of other commands",
    }
    text = ""
    for section in SECTIONS:
        text += f"## {titles[section]}\n\n"
        without_columns = []
        for output in described():
            if output.section != section:
                continue
            if not output.columns:
                without_columns.append((f"`{output.file}`", output.about + _when(output.when)))
                continue
            name = output.file if "`" in output.file else f"`{output.file}`"
            text += f"### {name}\n\n{output.about}\n\nOne row: {output.row}. Written by `{output.stage}`{_when(output.when)}\n\n"
            rows = [
                (
                    ", ".join(f"`{name}`" for name in column.names),
                    column.quantity,
                    column.unit or ("" if column.kind == "number" else column.kind),
                    column.meaning + (f" (only with {column.when})" if column.when else ""),
                )
                for column in output.columns
            ]
            text += _table(("column", "quantity", "unit or kind", "meaning"), rows) + "\n"
        if without_columns:
            text += (
                "### Files without columns\n\n"
                + _table(("file", "what it is"), without_columns)
                + "\n"
            )
        if section == "measure":
            codes = [(str(int(why)), SENTENCES.get(why.code, "may be used")) for why in RowStatus]
            text += "### Codes of `why`\n\n" + _table(("code", "meaning"), codes) + "\n"
    sentences = [(f"`{code}`", sentence) for code, sentence in SENTENCES.items()]
    text += "(codes)=\n## Codes of flags and reasons\n\n" + _table(("code", "sentence"), sentences)
    return f"{text}\nLogs, tracks and fits that were refused: {', '.join(_refusals())}.\n"


def _refusals() -> list[str]:
    """Codes of the errors that end as a reason in a table."""
    import rftfit

    files = Path(rftfit.__file__).parent.rglob("*.py")
    source = "".join(path.read_text(encoding="utf-8") for path in sorted(files))
    call = r"(?:(?:LogError|TrackError|Remark)\(|quoted\(\w+,)\s*\"([\w-]+)\""
    return sorted({f"`{code.replace('_', '-')}`" for code in re.findall(call, source)})


def _when(condition: str) -> str:
    return f"; only with {condition}." if condition else "."


def commands() -> str:
    """Every command with its arguments and options."""
    from rftfit.cli.app import make_command

    text = ""
    for name, command in make_command().commands.items():
        words = [
            f"{_metavar(parameter)}" for parameter in command.params if _is_argument(parameter)
        ]
        usage = " ".join(["rftfit", name, "[OPTIONS]", *words])
        text += f"## `rftfit {name}`\n\n{_paragraphs(command.help)}\n\nUsage: `{usage}`\n\n"
        rows = [_parameter(parameter) for parameter in command.params]
        rows.append(("`-h`, `--help`", "", "", "Show this and stop."))
        text += _table(("option", "value", "default", "meaning"), rows) + "\n"
        text += "".join(
            f"{label}: `{example.strip()}`\n\n"
            for label, _, example in (
                paragraph.partition(": ")
                for paragraph in (command.epilog or "").split("\n\n")
                if paragraph
            )
        )
    from rftfit.cli import exit_codes

    codes = [(str(code), meaning) for code, meaning in exit_codes.MEANINGS.items()]
    return text + "## Exit codes\n\n" + _table(("code", "meaning"), codes)


def _is_argument(parameter: Any) -> bool:
    return bool(parameter.param_type_name == "argument")


def _metavar(parameter: Any) -> str:
    word = parameter.metavar or parameter.name.upper()
    return word if parameter.required else f"[{word.strip('[]')}]"


def _parameter(parameter: Any) -> tuple[str, ...]:
    argument = _is_argument(parameter)
    names = [_metavar(parameter)] if argument else [*parameter.opts, *parameter.secondary_opts]
    value = "" if argument else parameter.metavar
    value += "; may be repeated" if parameter.multiple else ""
    default = (
        ""
        if parameter.default in (None, False, (), []) or callable(parameter.default)
        else f"`{parameter.default}`"
    )
    if getattr(parameter, "is_flag", False):
        default = (
            f"`{parameter.opts[0] if parameter.default else (parameter.secondary_opts or [''])[0]}`"
            if parameter.secondary_opts
            else ""
        )
    if parameter.required and not argument:
        default = "required"
    return (
        ", ".join(f"`{name}`" for name in names),
        value,
        default,
        " ".join((parameter.help or "").split()),
    )


def _paragraphs(text: str | None) -> str:
    """Help in paragraphs of one line, without the marks that only a terminal knows."""
    parts = re.split(r"\n\s*\n", (text or "").replace("\b", "").strip())
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in parts)


def robot() -> str:
    """Every key of a robot's file, every column of its run sheet."""
    from rftfit.campaign.schema import all_keys
    from rftfit.robot.config import Robot
    from rftfit.robot.tracks import COLUMNS

    words = ("required", "see below", "none")
    rows = [
        (
            f"`{'.'.join(key.path)}`",
            key.default if key.default in words else f"`{key.default}`",
            key.allowed,
            key.description,
        )
        for key in all_keys(Robot)
    ]
    keys = _table(("key", "default", "allowed", "meaning"), rows)
    columns = _table(
        ("column", "meaning"), [(f"`{column.name}`", column.meaning) for column in COLUMNS]
    )
    return f"## The robot's file\n\n{keys}\n## The robot's run sheet\n\n{columns}"


def profile() -> str:
    """Every key of a profile's file."""
    from rftfit.campaign.schema import all_keys
    from rftfit.model.profile_schema import ProfileFile

    rows = [(f"`{'.'.join(key.path)}`", key.type, key.description) for key in all_keys(ProfileFile)]
    return _table(("key", "type", "meaning"), rows)


def citation() -> str:
    """How to cite the program and the paper, from ``CITATION.cff``."""
    import yaml

    import rftfit

    path = Path(__file__).resolve().parents[2] / "CITATION.cff"
    cff = yaml.safe_load(path.read_text(encoding="utf-8"))
    if str(cff["version"]) != rftfit.__version__:
        raise ValueError(
            f"CITATION.cff: found version {cff['version']}; allowed: {rftfit.__version__}"
        )
    paper = cff["references"][0]
    people = [f"{author['family-names']}, {author['given-names']}" for author in paper["authors"]]
    makers = ", ".join(author["name"] for author in cff["authors"])
    version = f"version {cff['version']}, {cff['license']} licence"
    pages = (
        f"{paper['volume']}({paper['issue']}), {paper['start']}-{paper['end']} ({paper['year']})"
    )
    where = f"*{paper['journal']}* {pages}, [doi:{paper['doi']}](https://doi.org/{paper['doi']})"
    rows = [
        ("program", f"{makers}: {cff['title']}, {version}"),
        ("paper", f"{'; '.join(people)}: {paper['title']}, {where}"),
    ]
    table = _table(("what", "cite as"), rows)
    return f"""{table}
For BibTeX:

```text
@software{{rftfit,
  author  = {{{{{makers}}}}},
  title   = {{{cff["title"]}}},
  version = {{{cff["version"]}}},
  license = {{{cff["license"]}}}
}}
@article{{terradynamics,
  author  = {{{" and ".join(people)}}},
  title   = {{{paper["title"]}}},
  journal = {{{paper["journal"]}}},
  volume  = {{{paper["volume"]}}},
  number  = {{{paper["issue"]}}},
  pages   = {{{paper["start"]}--{paper["end"]}}},
  year    = {{{paper["year"]}}},
  doi     = {{{paper["doi"]}}}
}}
```
"""


PAGES: dict[str, Callable[[], str]] = {
    "api": api,
    "citation": citation,
    "commands": commands,
    "outputs": outputs,
    "profile": profile,
    "robot": robot,
}
"""What can be generated."""


class Generated(SphinxDirective):
    """Put generated Markdown where it stands."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Make the text and parse it as a part of the page."""
        return self.parse_text_to_nodes(PAGES[self.arguments[0]](), allow_section_headings=True)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive; Sphinx calls this."""
    app.add_directive("generated", Generated)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    print(PAGES[sys.argv[1]]())  # noqa: T201
