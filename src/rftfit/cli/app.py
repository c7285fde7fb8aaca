"""The list of commands of ``rftfit`` in the order of the help, with an example for each; words of the help."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Annotated, Any, get_type_hints

import typer

from rftfit.cli.check import check
from rftfit.cli.compare import compare
from rftfit.cli.diff import diff
from rftfit.cli.example import example
from rftfit.cli.exit_codes import MEANINGS
from rftfit.cli.export import export
from rftfit.cli.init import init
from rftfit.cli.inspect_log import inspect_log
from rftfit.cli.output import print_line
from rftfit.cli.plan import plan
from rftfit.cli.predict import predict
from rftfit.cli.reenact import reenact
from rftfit.cli.run import run
from rftfit.cli.scale import scale
from rftfit.cli.simulate import simulate, sweep
from rftfit.cli.verify import verify
from rftfit.cli.watch import watch
from rftfit.cli.wheel import wheel
from rftfit.version import __version__

# text at the end of `rftfit --help`, one paragraph per code: the help joins the lines of a paragraph
_EPILOG = "\n\n".join(
    [
        "Example: mkdir demo && cd demo && rftfit reenact && rftfit run",
        "Exit codes:",
        *(f"{code}: {meaning}" for code, meaning in MEANINGS.items()),
    ]
)

_HELP = ["-h", "--help"]

app = typer.Typer(
    name="rftfit",
    add_completion=False,
    # so that the lines of a paragraph are joined, whatever the width of the terminal
    rich_markup_mode="markdown",
    context_settings={"help_option_names": _HELP},
    epilog=_EPILOG,
)
_EXAMPLES: tuple[tuple[Callable[..., None], str], ...] = (
    (init, "init my_campaign"),
    (check, "check --config config/config.yaml"),
    (inspect_log, "inspect raw/paper/air/air_c_leg_force.csv --plot log.png"),
    (reenact, "reenact --media poppy_LP --fault gap --fault saturated"),
    (watch, "watch --json --target legs"),
    (
        run,
        (
            "run --cores 2\n\n"
            "Example with words for Snakemake itself, after two dashes: rftfit run -- --forceall"
        ),
    ),
    (verify, "verify results/coefficients.csv"),
    (diff, "diff results_before results"),
    (compare, "compare poppy_LP poppy_CP --figure compared.pdf"),
    (example, "example cmu-sand"),
    (scale, "scale --alpha 0.9 --se 0.02 --output sand.csv"),
    (plan, "plan --leg c_leg --pushes field.csv --pairs"),
    (export, "export --medium poppy_LP --output profile.json"),
    (
        predict,
        (
            "predict --leg c_leg --medium poppy_LP\n\n"
            "Example in the field, any outline: rftfit predict --outline scoop.csv --width 5 "
            "--path dig.csv --alpha 0.9"
        ),
    ),
    (
        wheel,
        (
            "wheel --mesh wheel.stl --unit mm --slip 0.1,0.3,0.5 --load 20 --alpha 0.9 --friction 0.4 "
            "--figure wheel.png"
        ),
    ),
    (simulate, "simulate --frequency 2 --curvature 1 --medium poppy_LP"),
    (sweep, "sweep --cores 2"),
)
"""Every command, in the order of the help, with the words of an example; the first word is its name."""

for _command, _words in _EXAMPLES:
    app.command(_words.split()[0], epilog=f"Example: rftfit {_words}")(_command)


def _show_version(is_asked: bool) -> None:
    """Print the version and stop, where --version is given; typer calls this for every command line."""
    if is_asked:
        print_line(f"rftfit {__version__}")
        raise typer.Exit


@app.callback()
def _top(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show the version and stop."
        ),
    ] = False,
) -> None:
    """Force-transducer logs to resistive-force models of granular media, with honest intervals.

    New here? In an empty folder, `rftfit reenact` writes a demonstration campaign, `rftfit run` makes
    everything out of it. For a campaign of your own: `rftfit init DIR`, `rftfit check`, `rftfit run`.
    """


_WORD_BY_TYPE = {"bool": "", "float": "NUMBER", "int": "NUMBER", "Path": "PATH"}
"""Words that stand in the help for the value of an option, by its type; of other types: NAME."""


@cache
def make_command() -> Any:
    """Return the command line as an object of click, the library below typer.

    Typer would show types (TEXT, INTEGER) for the values of options in the help: here each gets a word of `_WORD_BY_TYPE`
    or its own, and a switch none.
    """
    group: Any = typer.main.get_command(app)
    for parameter in group.params:
        parameter.metavar = ""
    for command in (group, *group.commands.values()):
        # the command keeps the option that it makes for its first context
        context = typer.Context(command, help_option_names=_HELP)
        command.get_help_option(context).metavar = ""
    for info in app.registered_commands:
        hints = get_type_hints(info.callback)
        for parameter in group.commands[info.name].params:
            # an option that has no word of its own yet
            if (
                parameter.param_type_name == "option"
                and parameter.metavar is None
                and parameter.name in hints
            ):
                # as text, such as "float | None", in which the name of the type is found
                annotation = str(hints[parameter.name])
                words = [word for name, word in _WORD_BY_TYPE.items() if name in annotation]
                parameter.metavar = [*words, "NAME"][0]
    return group
