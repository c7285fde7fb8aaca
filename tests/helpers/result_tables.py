"""Tables of results in any copy of their folder, and tables that a command wrote."""

import pandas as pd

from rftfit.outputs.dictionary import describe_file
from rftfit.results import Tables


def read_result(path):
    """Read a table of results, typed as the dictionary says; its name is the longest end of the path that the dictionary knows."""
    names = {folder: path.relative_to(folder).as_posix() for folder in reversed(path.parents)}
    folder, name = next(
        (folder, name) for folder, name in names.items() if describe_file(f"results/{name}")
    )
    return Tables(folder).table(name)


def read_output(path):
    """Read what a command wrote below lines of comment; untyped, since cells may be of any kind."""
    return pd.read_csv(path, comment="#")
