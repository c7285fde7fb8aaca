"""Pictures of the pages about bodies in space: ``python docs/_ext/space_pictures.py`` writes them into ``docs/images``.

The rover needs a graphics driver that MuJoCo can use without a screen (``MUJOCO_GL=egl`` or ``osmesa``).
"""

from __future__ import annotations

import os
import sys
import tempfile
from io import BytesIO
from pathlib import Path
from typing import Any

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs" / "images"
sys.path.insert(0, str(ROOT / "tests" / "helpers"))

from pages import Reader, blocks_of, fate


def save(picture: Image.Image, name: str, width: int) -> None:
    """Write a picture so wide as webp."""
    size = width, round(width * picture.height / picture.width)
    webp = BytesIO()
    picture.convert("RGB").resize(size, Image.Resampling.LANCZOS).save(webp, "webp", quality=70)
    (PICTURES / f"{name}.webp").write_bytes(webp.getvalue())


def follow(page: str, folder: Path) -> Reader:
    """Do what a page says in a new folder."""
    folder.mkdir()
    reader = Reader(folder)
    for block in blocks_of(f"docs/howto/{page}.md"):
        if fate(block) in ("file", "run"):
            reader.follow(block)
    return reader


def rover(folder: Path) -> Image.Image:
    """The rover of the page after its drive."""
    names: dict[str, Any] = {}
    (code,) = (b.text for b in blocks_of("docs/howto/mujoco.md") if b.language == "python")
    os.chdir(folder)
    exec(code, names)  # noqa: S102
    model, data, camera = names["model"], names["data"], mujoco.MjvCamera()
    camera.lookat[:] = data.qpos[:3]
    camera.distance, camera.azimuth, camera.elevation = 0.75, 130, -18
    with mujoco.Renderer(model, 500, 800) as renderer:
        renderer.update_scene(data, camera)
        return Image.fromarray(renderer.render())


def main() -> None:
    """Write both."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        picture = follow("space", folder / "space").folder / "wheel.png"
        save(Image.open(picture), "space_path", 1000)
        save(rover(follow("mujoco", folder / "mujoco").folder), "space_rover", 800)
        os.chdir(ROOT)


if __name__ == "__main__":
    main()
