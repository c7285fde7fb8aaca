"""JSON schema of a robot's file, for editors that check while one types.

``python -m rftfit.robot.schema`` in the project's folder writes ``config/robot.schema.json``; a test
holds it in step with the models.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from rftfit.errors import RftfitError
from rftfit.robot.config import Robot
from rftfit.store import write_text


def json_schema() -> str:
    """Write the schema of ``robot.yaml``.

    Returns
    -------
    str
        The same bytes whenever the models are the same.
    """
    page = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **Robot.model_json_schema(),
    }
    return json.dumps(page, indent=2, ensure_ascii=False, sort_keys=True) + "\n"


def main(folder: Path) -> None:
    """Write the schema.

    Parameters
    ----------
    folder : Path
        Usually ``config``.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    write_text(folder / "robot.schema.json", json_schema())


if __name__ == "__main__":
    try:
        main(Path("config"))
    except RftfitError as error:
        sys.exit(str(error))
