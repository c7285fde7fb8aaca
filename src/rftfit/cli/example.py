"""``rftfit example``: a campaign of recorded logs, downloaded and run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from rftfit.campaign.problems import choose
from rftfit.cli.output import count, megabytes, print_line
from rftfit.cli.run import run
from rftfit.errors import InputError, OutputError
from rftfit.store import copy_file, write_bytes
from rftfit.store.links import refuse_links, refuse_target_by_link

SUMS = "logs.sha256"
EXAMPLES = {
    "cmu-sand": "https://raw.githubusercontent.com/robomechanics/3d-terramechanics/"
    "55a6e92b35cb7a94530e47311fd7c4767fafb835/raw-data-processing/f-d-large-box/"
}
"""Address of the logs by the name of the example; its config says who recorded them."""


def copy_example(source: Path, folder: Path) -> None:
    """Copy configuration and run sheet into the folder; what is there is never overwritten."""
    from rftfit.store.digests import read_sums

    config_files = sorted((source / "config").iterdir())
    logs = (f"raw/{name}" for name in read_sums(source / SUMS))
    refuse_target_by_link(folder)
    refuse_links(folder, [*(f"config/{file.name}" for file in config_files), *logs])
    for file in config_files:
        target = folder / "config" / file.name
        if not target.exists():
            write_bytes(target, file.read_bytes())


def fetch_logs(source: Path, raw: Path, origin: str) -> None:
    """Bring the logs that are not there yet into the raw folder, each checked against its sha256.

    `origin`: A folder or an address.
    """
    from rftfit.store.digests import read_sums

    sums = read_sums(source / SUMS)
    lacking = {name: digest for name, digest in sums.items() if not _is_right(raw / name, digest)}
    if not lacking:
        print_line(f"All {count(len(sums), 'log')} are there, checked against their sha256.")
        return
    wrong = [name for name in lacking if (raw / name).exists()]
    if wrong:
        raise InputError(
            f"{raw / wrong[0]}: not the log of that name (its sha256 differs), and "
            f"{count(len(wrong) - 1, 'other')} like it; move them away"
        )
    try:
        raw.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"{raw}: cannot be made: {error.strerror}; allow writing there or name another folder"
        ) from error
    if "://" in origin:
        _download(f"{origin.rstrip('/')}/", raw, lacking)
    else:
        _copy(Path(origin), raw, lacking)
    size = megabytes(sum((raw / name).stat().st_size for name in lacking))
    print_line(
        f"{count(len(lacking), 'log')}, {size}, from {origin}, checked against their sha256."
    )


def _is_right(path: Path, digest: str) -> bool:
    from rftfit.store.digests import sha256_of

    return path.is_file() and sha256_of(path) == digest


def _copy(folder: Path, raw: Path, digests: Mapping[str, str]) -> None:
    for name, digest in digests.items():
        if not (folder / name).is_file():
            raise InputError(
                f"--from: no {name} in {folder}; allowed: a folder with all logs of the example"
            )
        if not _is_right(folder / name, digest):
            raise InputError(
                f"--from: {folder / name} is not the log of that name (sha256 differs)"
            )
        copy_file(folder / name, raw / name)


def _download(address: str, raw: Path, digests: Mapping[str, str]) -> None:
    try:
        import pooch
    except ImportError:
        raise InputError(
            "logs are downloaded with the package pooch; install it: pip install pooch; or give a folder "
            "that has them: --from DIR"
        ) from None
    pooch.get_logger().setLevel("ERROR")
    registry = {name: f"sha256:{digest}" for name, digest in digests.items()}
    with TemporaryDirectory(prefix="rftfit-example-") as downloads:
        store = pooch.create(path=downloads, base_url=address, registry=registry, retry_if_failed=2)
        for place, name in enumerate(digests, start=1):
            print_line(f"  {place} of {len(digests)}: {name}")
            try:
                downloaded_path = store.fetch(name)
            except (OSError, ValueError) as error:
                # the libraries below raise errors of many kinds, all of these two families
                raise InputError(
                    f"{address}{name}: cannot be downloaded ({str(error).splitlines()[0][:200]}); without "
                    "a connection, give a folder that has the logs: --from DIR"
                ) from error
            copy_file(downloaded_path, raw / name)


def example(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Which example: cmu-sand.")],
    folder: Annotated[
        Path | None,
        typer.Argument(metavar="DIR", help="Where to; default: a folder of the example's name."),
    ] = None,
    origin: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="DIR or URL",
            help="Take the logs from this folder or mirror instead of the public repository.",
        ),
    ] = None,
) -> None:
    """Download a campaign of recorded logs and run it, as `rftfit run` does.

    cmu-sand: nine penetrations of circular plates of three sizes into sand, force in ROS bags and
    motion in text files on another clock (23 MB), recorded by Catherine Pavlov and Aaron Johnson,
    Carnegie Mellon University (MIT licence).
    """
    from rftfit.store.environment import shipped

    address = EXAMPLES[choose("example", name, tuple(EXAMPLES))]
    source, folder = shipped(f"examples/{name}"), folder or Path(name)
    copy_example(source, folder)
    fetch_logs(source, folder / "raw", origin or address)
    run(config=folder / "config" / "config.yaml")
