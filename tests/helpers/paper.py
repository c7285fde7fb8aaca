"""The demonstration's configuration, changed or not, and campaigns with it in folders."""

from pathlib import Path

import yaml
from disturbances import NOTHING, reenact_disturbed

from rftfit.campaign.config import Config
from rftfit.lab.enact import reenact

PROJECT = Path(__file__).resolve().parents[2]


def paper_values(*without):
    """Values of the demonstration's config, to be changed, without some sections."""
    values = yaml.safe_load((PROJECT / "config" / "config.yaml").read_text(encoding="utf-8"))
    return {name: section for name, section in values.items() if name not in without}


def paper_config(**changes):
    """The demonstration's config, some sections of it changed."""
    return Config.model_validate(paper_values()).model_copy(update=changes)


def write_yaml(path, values):
    """Write values into a file, whose folder is made, too."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = yaml.safe_dump(values, sort_keys=False, allow_unicode=True)
    path.write_text(text, encoding="utf-8")


def enact(root, values, sizes=NOTHING, **options):
    """Write a config, and the logs and run sheet that the re-enacted lab makes of it; the config's path.

    `sizes`: Of disturbances.
    """
    path, raw = root / "config" / "config.yaml", root / "raw" / "paper"
    write_yaml(path, values)
    config = Config.model_validate(values)
    if sizes:
        reenact_disturbed(config, raw, raw / "runs.csv", sizes, **options)
    else:
        reenact(config, raw, raw / "runs.csv", **options)
    return path
