"""Formats of an example of the validation suite: ``example.yaml`` and ``answer.csv`` in its folder, read and checked.

An example is measured data of somebody else, commands of this program that are run on them, and an *answer*: numbers that
the authors published. Each row of ``answer.csv`` has a published number, and a *key*, cells that name the row of a table
of results where the program's number stands, as ``medium=yuma; leg=c_leg``. Its *quantity*, an entry of ``example.yaml``,
says in which table and column.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from string import hexdigits
from typing import Annotated, Any, Literal, NamedTuple, get_args

import numpy as np
from pydantic import AfterValidator, Field, field_validator, model_validator

from rftfit.campaign.config import Model, Name, Number, Positive
from rftfit.campaign.presence import CONFIG
from rftfit.campaign.problems import CampaignError, choose, did_you_mean
from rftfit.campaign.reading import read_model
from rftfit.campaign.rows import DraftRow, Schema, TableColumn, read_rows
from rftfit.errors import InputError
from rftfit.store.environment import shipped

SETTINGS, ANSWER, README = "example.yaml", "answer.csv", "README.md"
"""The three files of an example."""


Domain = Literal["plates", "penetrations", "legs", "robot", "wheels"]
DOMAINS = get_args(Domain)
"""Kinds of compared numbers, in the order of the page."""


def _check_relative(name: str) -> str:
    """Return the path `name`; raise ValueError if it is absolute or leaves the folder of the example.

    An example may come from a stranger: its files must not be written elsewhere.
    """
    path = PurePosixPath(name)
    if not name or path.is_absolute() or ".." in path.parts or "\\" in name or ":" in name:
        raise ValueError("a path inside the folder of the example wanted, with /")
    return name


RelativePath = Annotated[str, AfterValidator(_check_relative)]


_HEX_DIGITS = 64
"""Digits of a SHA-256."""


class ExampleFile(Model):
    """A file of recorded data, known by its digest."""

    name: RelativePath
    """its path below `raw/`"""
    address: str = ""
    """where it is downloaded from; without one it is shipped beside `example.yaml`"""
    sha256: str
    """SHA-256 of its content, 64 hexadecimal digits"""
    size: Annotated[int, Field(ge=1)]
    """its bytes"""
    licence: str
    """its licence, or that none is stated"""
    may_be_shipped: bool = False
    """whether that licence lets this program ship it, and show its numbers"""

    @field_validator("sha256")
    @classmethod
    def _is_digest(cls, digest: str) -> str:
        """Return a digest in lower case; raise ValueError for any other text."""
        if len(digest) != _HEX_DIGITS or not set(digest) <= set(hexdigits):
            raise ValueError(f"{_HEX_DIGITS} hexadecimal digits wanted")
        return digest.lower()

    @model_validator(mode="after")
    def _has_origin(self) -> ExampleFile:
        """Refuse a file that can come from nowhere."""
        if not self.address and not self.may_be_shipped:
            raise ValueError("a file that may not be shipped needs an address")
        return self


class NumberCells(Model):
    """Where a number stands in a table."""

    table: RelativePath
    """the table, from the folder of the example; `{name}` stands for a word of the key"""
    value: str
    """column of the number"""
    lo: str | None = None
    """column of the lower end of its 95 % interval"""
    hi: str | None = None
    """column of the upper end"""
    se: str | None = None
    """column of its standard error, instead of both ends"""
    error: str | None = None
    """column of the difference that is allowed, for a published number"""
    factor: Number = 1.0
    """what the number is multiplied with, to the unit of the answer"""
    row: dict[str, str] = Field(default_factory=dict)
    """cells of its row by column, `{name}` for a word of the key; default: the words that `table` does not use"""

    @model_validator(mode="after")
    def _has_one_interval(self) -> NumberCells:
        """Refuse one end of an interval without the other, and ends beside a standard error."""
        if (self.lo is None) != (self.hi is None) or (self.lo is not None and self.se is not None):
            raise ValueError("either `lo` and `hi` or `se`")
        return self


class GivenNumber(NumberCells):
    """A number that a command takes from the result of an earlier one, by its place in a table."""

    key: str
    """row of the table, as `column=value; column=value`"""


class Windows(Model):
    """Windows of depth, each of which slopes (alpha) are fitted over: all count, so that none is chosen to fit the answer."""

    from_cm: Positive
    """the least depth at which a window begins"""
    to_cm: Positive
    """the greatest depth at which one ends"""
    step_cm: Positive
    """between their ends"""

    @property
    def ends(self) -> list[tuple[float, float]]:
        """Least and greatest depth of each window, cm: all pairs of the depths from `from_cm` to `to_cm` in these steps."""
        count = round((self.to_cm - self.from_cm) / self.step_cm)
        depths = np.linspace(self.from_cm, self.to_cm, count + 1).round(6).tolist()
        return [(first, last) for first in depths for last in depths if first < last]

    @model_validator(mode="after")
    def _has_windows(self) -> Windows:
        """Refuse depths that are not some whole steps apart; every window costs a fit of all pushes."""
        steps = (self.to_cm - self.from_cm) / self.step_cm
        if not 1 <= steps <= 100 or abs(steps - round(steps)) > 1e-6:
            raise ValueError("1 to 100 whole steps between from_cm and to_cm wanted")
        return self


class Judged(Model):
    """Columns of a table of results whose rows state a verdict themselves, as the reproduction table does."""

    column: str
    """column of the verdict"""
    inside: list[str]
    """its words for a row that fits"""
    outside: list[str]
    """its words for a row that does not; with all other words a row is not comparable"""
    reason: str
    """column of the reason"""


class Quantity(Model):
    """A quantity of the answer, such as "alpha, upward": where the program's number stands, and by which rule it is judged."""

    title: str
    """what it is, for people"""
    domain: Domain
    """what is compared"""
    ours: NumberCells
    """the program's number"""
    published: NumberCells | None = None
    """the published number, where it stands in a table instead of answer.csv"""
    windows: Windows | None = None
    """windows of depth over which the verdict is formed; the table is that of a medium's alpha"""
    judged: Judged | None = None
    """the verdict of the table itself, instead of the rule of intervals"""

    @model_validator(mode="after")
    def _has_a_medium(self) -> Quantity:
        """Refuse windows of depth for a number that is no alpha of a medium, as only slopes have windows."""
        if self.windows is not None and "{medium}" not in self.ours.table:
            raise ValueError(
                "`windows` want a table of a medium's alpha: results/alpha/{medium}.csv"
            )
        return self


class RemarkOnRows(Model):
    """What is known of some rows of the answer, chosen by `quantities` and `match`.

    It says why they cannot be compared, why they lie outside the errors, or what it does not prove that they lie inside.
    """

    code: Name
    """a short name of the reason"""
    sentence: str
    """the reason"""
    quantities: list[Name] = Field(default_factory=list)
    """quantities that it is about; default: all"""
    match: dict[str, str] = Field(default_factory=dict)
    """words of the key, or cells of the program's table, that the rows have"""
    comparable: bool = True
    """whether the rows are compared at all"""
    of_inside: bool = False
    """whether it is said of rows that lie inside, not of those outside"""


class ExampleSettings(Model):
    """An example of the validation suite: the content of its ``example.yaml``."""

    title: str
    """one line"""
    citation: str
    """who measured and who published, with the source"""
    note: str = ""
    """what a reader must know of all its verdicts"""
    in_view: str = ""
    """what of the program was chosen with these published answers in view, so that they are no blind test"""
    files: list[ExampleFile] = Field(default_factory=list)
    """recorded data that it needs"""
    campaign: dict[str, str] = Field(default_factory=dict)
    """files of a campaign by their path, as `config/config.yaml` and `config/runs.csv`, with their content"""
    copied: dict[str, str] = Field(default_factory=dict)
    """files by their path, and the file of this program that each is a copy of"""
    given: dict[Name, GivenNumber] = Field(default_factory=dict)
    """numbers that commands take from earlier results: `{name}` in a command"""
    commands: list[str] = Field(default_factory=list)
    """commands of rftfit that are run one after another; default: `run` where there is a campaign"""
    quantities: dict[Name, Quantity]
    """quantities of answer.csv by their name"""
    remarks: list[RemarkOnRows] = Field(default_factory=list)
    """what is known of some rows; the first that fits counts"""

    @field_validator("campaign", "copied")
    @classmethod
    def _stay_below(cls, texts: dict[str, str]) -> dict[str, str]:
        """Return texts by path; refuse a path that leaves the folder of the example."""
        return {_check_relative(name): text for name, text in texts.items()}

    @model_validator(mode="after")
    def _does_something(self) -> ExampleSettings:
        """Refuse an example without anything to run."""
        if not (self.commands or CONFIG in self.campaign):
            raise ValueError(f"either `commands` or a campaign with {CONFIG} wanted")
        return self


EVERY = "*"
"""Word of a key that any cell agrees with: the row of the answer stands for all such rows of the table."""

_ANSWER = Schema(
    "answer",
    (
        TableColumn("quantity", "text", "as example.yaml names it"),
        TableColumn("key", "text", "row of the program's table: column=value; column=value"),
        TableColumn("value", "number", "published number", needed=False),
        TableColumn("error", "number", "its own error", needed=False, low=0.0),
        TableColumn("unit", "text", "of both", needed=False),
        TableColumn("where", "text", "where it is stated"),
    ),
    rows="published numbers",
)
"""Columns of answer.csv."""


class Published(NamedTuple):
    """A row of answer.csv; a number that is not stated is NaN.

    `key`: Cells of the row in the program's table, by column. `error`: That of `value`, as published. `where`: Place in the
    publication.
    """

    quantity: str
    key: dict[str, str]
    value: float
    error: float
    unit: str
    where: str


@dataclass(frozen=True)
class Example:
    """An example: its name and folder, the content of its example.yaml, and the published answer."""

    name: str
    folder: Path
    settings: ExampleSettings
    answer: list[Published] = field(repr=False)

    @property
    def commands(self) -> list[str]:
        """Commands of rftfit that are run one after another, without the word rftfit."""
        return self.settings.commands or ["run"]

    @property
    def readme(self) -> str:
        """Text of README.md below its heading, up to the next heading, for the page of verdicts."""
        text = (self.folder / README).read_text(encoding="utf-8")
        without_heading = text.partition("\n")[2] if text.startswith("# ") else text
        return without_heading.partition("\n## ")[0].strip()

    @property
    def domains(self) -> list[str]:
        """Domains of the quantities of the answer, in the order of the page."""
        domains = {quantity.domain for quantity in self.settings.quantities.values()}
        return [domain for domain in DOMAINS if domain in domains]

    def as_dict(self) -> dict[str, Any]:
        """Return the facts for a list of examples, for JSON."""
        return {
            "name": self.name,
            "title": self.settings.title,
            "domains": self.domains,
            "answers": len(self.answer),
            "files": len(self.settings.files),
            "bytes": sum(file.size for file in self.settings.files),
            "licences": sorted({file.licence for file in self.settings.files}),
        }


def read_example(folder: Path) -> Example:
    """Read an example from its folder, which has three files; one error reports all problems.

    Raises
    ------
    CampaignError
        With every problem of the files.
    """
    lacking = [name for name in (SETTINGS, ANSWER, README) if not (folder / name).is_file()]
    if lacking:
        raise InputError(
            f"{folder}: {', '.join(lacking)} not there; an example is a folder with {SETTINGS}, {ANSWER} and {README}"
        )
    file = read_model(folder / SETTINGS, ExampleSettings)
    rows, problems = read_rows(folder / ANSWER, _ANSWER)
    quantities = {} if file.model is None else file.model.quantities
    answer = [_read_answer(row, quantities) for row in rows]
    if file.model is None or problems:
        raise CampaignError([*file.problems, *problems])
    return Example(folder.resolve().name, folder, file.model, answer)


def _read_answer(row: DraftRow, quantities: Mapping[str, Quantity]) -> Published:
    """Read a row of the answer; add a problem to it for a wrong key, an unknown quantity, or a number that is nowhere.

    `quantities`: Those of example.yaml; empty where that file has an error of its own.
    """
    quantity = row.text.get("quantity", "")
    key: dict[str, str] = {}
    value = row.number.get("value", np.nan)
    if "key" not in row.bad:
        try:
            key = parse_key(row.text["key"])
        except ValueError as error:
            row.note("key", "key", row.text["key"], str(error))
    if quantities and "quantity" not in row.bad:
        if quantity not in quantities:
            nearest = did_you_mean(quantity, quantities)
            row.note("quantity", "quantity", quantity, f"one of {', '.join(quantities)}", nearest)
        elif np.isnan(value) and "value" not in row.bad and quantities[quantity].published is None:
            row.note("value", "value", None, f"a number; or {SETTINGS} says in which table it is")
    error_of_value = row.number.get("error", np.nan)
    unit, where = row.text.get("unit", ""), row.text.get("where", "")
    return Published(quantity, key, value, error_of_value, unit, where)


def parse_key(text: str) -> dict[str, str]:
    """Parse a key, ``column=value; column=value``, to values by column; raise ValueError for any other text."""
    pairs = [pair.partition("=") for pair in text.split(";") if pair.strip()]
    key = {name.strip(): value.strip() for name, sign, value in pairs if sign}
    if len(key) != len(pairs) or not all(key) or not all(key.values()):
        raise ValueError("column=value, or several with ; between them")
    return key


def format_key(key: Mapping[str, str]) -> str:
    """Format a key as `parse_key` parses it."""
    return "; ".join(f"{name}={value}" for name, value in key.items())


def list_examples() -> list[str]:
    """Return the names of the examples that come with the program."""
    folders = shipped("examples").iterdir()
    return sorted(folder.name for folder in folders if (folder / SETTINGS).is_file())


def find_example(name: str) -> Example:
    """Read an example that comes with the program, by its name, or any other example, by its folder."""
    if Path(name).name != name or (Path(name) / SETTINGS).is_file():
        return read_example(Path(name))
    choose("example", name, tuple(list_examples()), "or a folder that holds one, as ./mine")
    return read_example(shipped(f"examples/{name}"))
