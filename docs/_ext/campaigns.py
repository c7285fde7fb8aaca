"""The campaigns whose pages the gallery shows, made by the commands of a reader: ``make gallery``.

python docs/_ext/campaigns.py [LOGS]      LOGS: where the logs of the example are, else downloaded
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1]
FOLDER = DOCS / "_campaigns"


def one_push() -> str:
    """Configuration of the tutorial's campaign, from its page."""
    page = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    _, _, rest = page.partition("<!-- file: config/config.yaml -->\n```yaml\n")
    return rest.partition("\n```")[0] + "\n"


def command(folder: Path, *words: str) -> None:
    """Call ``rftfit`` in the folder of a campaign."""
    sys.stdout.write(f"{folder.name}: rftfit {' '.join(words)}\n")
    sys.stdout.flush()
    subprocess.run([Path(sys.executable).with_name("rftfit"), *words], cwd=folder, check=True)


def make(logs: str | None) -> None:
    """Write the campaigns and run them; what is up to date stays.

    `logs`: Folder of the example's logs.
    """
    paper, push = FOLDER / "demonstration", FOLDER / "one-push"
    shutil.copytree(DOCS.parent / "config", paper / "config", dirs_exist_ok=True)
    (push / "config").mkdir(parents=True, exist_ok=True)
    (push / "config" / "config.yaml").write_text(one_push(), encoding="utf-8")
    for folder in (paper, push):
        command(folder, "reenact", "--if-missing")
        command(folder, "run")
    command(FOLDER, "example", "cmu-sand", *(["--from", logs] if logs else []))
    command(FOLDER / "cmu-sand", "run")


if __name__ == "__main__":
    make(str(Path(sys.argv[1]).resolve()) if sys.argv[1:] else None)
