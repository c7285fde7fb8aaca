"""axe-core on report pages: both themes, everything open.

make accessible                             the page of the published tables, and the live page of a watch
make accessible ARGS="results/report.html"  others
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "helpers"))
import chromium
from campaigns import lay_bench, make_campaign
from result_tables import page_results

import rftfit.bench
from rftfit.bench.page import page_of
from rftfit.page.page import page

AXE = ROOT / ".mutants" / "axe" / "axe_playwright_python" / "axe.min.js"
ASK = """axe.run(document, {resultTypes: ["violations"]}).then((told) => JSON.stringify(told.violations
  .map((one) => [one.id, one.impact, one.help, one.nodes.map((node) => node.html.slice(0, 120))])))"""


def live_page(root):
    """What a browser shows of a watch after two pushes."""
    recorded = make_campaign(root / "recorded", ("poppy_LP",), plates_only=True).root
    bench = lay_bench(root / "bench", recorded)
    watch = bench.watch()
    bench.push(*bench.plates[:2])
    bench.settle(watch)
    shell = Path(rftfit.bench.__file__).with_name("page.html").read_text(encoding="utf-8")
    return shell.replace('<main id="main">', f'<main id="main">{page_of(watch, "")}')


def main(pages):
    """Print every finding; the exit status says whether there is one."""
    program = chromium.find()
    if program is None:
        print("There is no Chromium here.")
        return 2
    # colour contrast of a long page takes minutes on a slow machine
    chromium._DEADLINE_S = 600.0
    number = 0
    with (
        tempfile.TemporaryDirectory() as profile,
        chromium.Chromium(program, Path(profile)) as browser,
    ):
        browser.call("Page.setBypassCSP", enabled=True)
        for path in pages:
            for theme in ("light", "dark"):
                browser.open(path.resolve().as_uri())
                calm = {"name": "prefers-reduced-motion", "value": "reduce"}
                chosen = {"name": "prefers-color-scheme", "value": theme}
                browser.call("Emulation.setEmulatedMedia", features=[calm, chosen])
                browser.evaluate(
                    "for (const one of document.querySelectorAll('details')) one.open = true"
                )
                browser.evaluate(f"{AXE.read_text(encoding='utf-8')};0")
                findings = json.loads(browser.evaluate(ASK))
                number += len(findings)
                print(
                    f"{path.name}, {theme}: {len(findings)} findings; console: {browser.complaints() or 'silent'}"
                )
                for rule, impact, what, nodes in findings:
                    print(f"  {rule} ({impact}): {what}", *nodes[:5], sep="\n    ")
    return min(number, 1)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(word) for word in sys.argv[1:]]
        if not paths:
            paths = [Path(folder) / "report.html", Path(folder) / "live.html"]
            report = page(page_results(Path(folder) / "lab", robot=True))
            for path, text in zip(paths, (report, live_page(Path(folder) / "rig")), strict=True):
                path.write_text(text, encoding="utf-8")
        sys.exit(main(paths))
