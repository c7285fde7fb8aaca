"""A notebook as a page, run by the build.

What a cell prints, the value of its last line and its figures stand below it.
"""

from __future__ import annotations

import ast
import contextlib
import io
import json
import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sphinx.util.docutils import SphinxDirective

if TYPE_CHECKING:
    from docutils import nodes
    from matplotlib.figure import Figure
    from sphinx.application import Sphinx


def run(code: str, names: dict[str, Any]) -> tuple[str, list[Figure]]:
    """Run a cell as a notebook does: text that it shows, and figures.

    `names`: Of the blocks before it; what this one defines is added.
    """
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    body = ast.parse(code).body
    last = body.pop() if body and isinstance(body[-1], ast.Expr) else None
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(ast.Module(body, []), "<page>", "exec"), names)  # noqa: S102
        value = None
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "<page>", "eval"), names)
    if value is not None and not code.rstrip().endswith(";"):
        printed.write(value.to_string() if hasattr(value, "to_string") else repr(value))
    figures = [plt.figure(number) for number in plt.get_fignums()]
    plt.close("all")
    return printed.getvalue().rstrip(), figures


class Notebook(SphinxDirective):
    """Run a notebook and show it as a page."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Text as it is, code with its output."""
        with tempfile.TemporaryDirectory() as bare, contextlib.chdir(bare):
            markdown = self.text()
        return self.parse_text_to_nodes(markdown, allow_section_headings=True)

    def block(self, code: str, names: dict[str, Any], base: str, alt: str) -> str:
        """Markdown of a block and what comes of it; figures are written below ``_build``."""
        text, figures = run(code, names)
        markdown = f"```python\n{code}\n```\n\n"
        if text:
            markdown += f"```{{code-block}} text\n:class: output\n\n{text}\n```\n\n"
        folder = Path(self.env.srcdir) / "_build" / "figures"
        folder.mkdir(parents=True, exist_ok=True)
        for number, figure in enumerate(figures, start=1):
            name = f"{base}_{number}.png"
            figure.savefig(folder / name, dpi=110, metadata={"Software": None})
            markdown += f"![{alt}](/_build/figures/{name})\n\n"
        return markdown

    def text(self) -> str:
        """Markdown of all cells."""
        _, path = self.env.relfn2path(self.arguments[0])
        self.env.note_dependency(path)
        names: dict[str, Any] = {}
        markdown = title = ""
        for number, cell in enumerate(json.loads(Path(path).read_text(encoding="utf-8"))["cells"]):
            text = "".join(cell["source"])
            if cell["cell_type"] == "code":
                markdown += self.block(
                    text, names, f"{Path(path).stem}_{number}", f"figure: {title}"
                )
                continue
            title = next((line.strip("# ") for line in text.splitlines() if line[:1] == "#"), title)
            # what stands above the first heading would come below all of them
            markdown += re.sub(r"^# ", "## ", text) + "\n\n"
        return markdown


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive; Sphinx calls this."""
    app.add_directive("notebook", Notebook)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
