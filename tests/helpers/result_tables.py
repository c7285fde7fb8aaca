"""Tables of results in any copy of their folder, with the types that the dictionary states."""

from rftfit.outputs.dictionary import describe_file
from rftfit.results import Tables


def read_result(path):
    """Read a table of results; its name is the longest end of the path that the dictionary knows."""
    names = {folder: path.relative_to(folder).as_posix() for folder in reversed(path.parents)}
    folder, name = next(
        (folder, name) for folder, name in names.items() if describe_file(f"results/{name}")
    )
    return Tables(folder).table(name)
