"""The home rig of the documentation: its made logs, its sheet and its config, and what it knows to be true."""

from pathlib import Path

from doc_blocks import blocks_of

from rftfit.cli.init import init_campaign

PAGE = "docs/howto/home-rig.md"
_BLOCKS = blocks_of(PAGE)
SCRIPT = next(block.text for block in _BLOCKS if block.language == "python")
FILES = {block.marks["file"]: block.text for block in _BLOCKS if "file" in block.marks}


def lay_out_home_rig(folder, monkeypatch, **changes):
    """Follow the page in `folder` up to the config; the campaign's folder, and the names of its script.

    `changes`: Texts of the script and what stands in their place.
    """
    monkeypatch.chdir(folder)
    init_campaign(Path("home rig"))
    script = SCRIPT
    for old, new in changes.get("script", {}).items():
        assert old in script
        script = script.replace(old, new)
    names: dict[str, object] = {}
    exec(script, names)  # noqa: S102
    for name, text in FILES.items():
        Path(name).write_text(text, encoding="utf-8")
    return Path(folder, "home rig"), names
