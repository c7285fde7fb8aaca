"""Every file of the program is written by `rftfit.store.files`: no other module opens one for writing."""

import ast
from pathlib import Path

import pytest

import rftfit

SRC = Path(rftfit.__file__).parents[1]
WRITERS = ("rftfit/store/files.py", "rftfit/store/links.py", "rftfit/store/tables.py")
"""Modules that may: files; the link of --results-at; what a library writes into the new file beside a target."""

METHODS = {"write_text", "write_bytes", "touch", "symlink_to", "hardlink_to"}
METHODS |= {"copy2", "copyfile", "copytree", "move", "truncate", "utime", "symlink", "link"}
METHODS |= {"mkstemp", "NamedTemporaryFile", "savez_compressed", "savetxt"}
METHODS |= {"tofile", "memmap", "imsave", "ExcelWriter"}
"""Attributes whose call writes or moves a file, whatever its arguments are; `os.fdopen` takes what one of them opened, or a pipe."""


def writes_of(source):
    """Lines of a module in which a file is opened for writing, made, moved or changed."""
    calls = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)]
    return [call.lineno for call in calls if _writes(call)]


def _writes(node):
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    is_method = isinstance(node.func, ast.Attribute)
    owner = ast.unparse(node.func.value) if isinstance(node.func, ast.Attribute) else ""
    positional = [ast.unparse(argument) for argument in node.args]
    if name == "open" and owner == "os":
        return positional[0] != "os.devnull"
    if name == "open":
        modes = [word.value for word in node.keywords if word.arg == "mode"]
        if not is_method or owner in ("gzip", "bz2", "lzma", "io", "codecs"):
            modes += node.args[1:2]
        elif node.args and isinstance(node.args[0], ast.Constant):
            # of a path; what an archive opens is a name
            modes += node.args[:1]
        return any(
            not isinstance(mode, ast.Constant) or set("wax+") & set(str(mode.value))
            for mode in modes
        )
    if name == "ZipFile":
        return any(set("wax") & set(mode.strip("'\"")) for mode in positional[1:2])
    if name in ("replace", "rename") and is_method:
        # a path has one argument, a text two, a table and a dataclass keywords
        return owner == "os" or (len(positional) == 1 and not node.keywords)
    if name == "copy" and owner == "shutil":
        return True
    if name in ("to_csv", "to_json", "to_excel", "to_html"):
        return bool(positional) and positional[0] != "None"
    if name in ("to_parquet", "savefig", "save", "savez") and is_method:
        # what has a method `save` of its own goes through the store
        return positional[:1] != ["buffer"] and (name != "save" or owner in ("np", "first_frame"))
    return is_method and name in METHODS and owner not in ("files", "store")


@pytest.mark.parametrize(
    "line",
    [
        "path.open('w')",
        "path.open(mode='ab')",
        "open(path, 'r+b')",
        "open(path, mode)",
        "os.open(path, os.O_RDWR | os.O_CREAT)",
        "gzip.open(path, 'wt')",
        "path.write_text(text)",
        "path.write_bytes(data)",
        "path.touch()",
        "a.replace(b)",
        "os.replace(a, b)",
        "os.rename(a, b)",
        "shutil.copyfile(a, b)",
        "shutil.copy(a, b)",
        "table.to_csv(path, index=False)",
        "figure.savefig(path)",
        "np.save(path, x)",
        "os.utime(path)",
        "tempfile.mkstemp()",
        "zipfile.ZipFile(path, 'w')",
    ],
)
def test_each_way_to_write_is_seen(line):
    assert writes_of(line) == [1]


@pytest.mark.parametrize(
    "line",
    [
        "path.open('rb')",
        "path.open()",
        "np.load(path)",
        "open(path)",
        "open(path, 'rb')",
        "os.open(os.devnull, os.O_WRONLY)",
        "write_text(path, text)",
        "text.replace('a', 'b')",
        "replace(run, x=1)",
        "table.to_csv(None, index=False)",
        "figure.savefig(buffer, format='png')",
        "zipfile.ZipFile(path)",
    ],
)
def test_reading_is_no_writing(line):
    assert writes_of(line) == []


def test_no_other_module_writes_a_file():
    modules = {path.relative_to(SRC).as_posix(): path for path in SRC.rglob("*.py")}
    assert len(modules) > 200
    written = {name: writes_of(path.read_text("utf-8")) for name, path in modules.items()}
    assert all(written[name] for name in WRITERS)
    assert {name: lines for name, lines in written.items() if lines and name not in WRITERS} == {}
