"""Small and read-only disks, in a mount namespace of the test's own, where the system lets one have it."""

import functools
import shutil
import subprocess
import sys

_OWN = ("unshare", "--user", "--map-root-user", "--mount")
BLOCK = 4096


@functools.cache
def why_not():
    """Why no disk can be made here; empty where it can."""
    if not sys.platform.startswith("linux") or shutil.which("unshare") is None:
        return "disks of a test's own need Linux and unshare"
    trial = [*_OWN, "sh", "-c", "mount -t tmpfs -o size=64k tmpfs /mnt"]
    completed = subprocess.run(trial, capture_output=True, text=True, check=False)
    return (
        f"this system allows no disk of a test's own: {completed.stderr.strip()}"
        if completed.returncode
        else ""
    )


def on_own_disks(words, **options):
    """Run a program that may mount: what it mounts nobody else sees, and goes with it."""
    return subprocess.run([*_OWN, *words], text=True, check=False, **options)


def mount(folder, size):
    """Mount a disk of so many bytes on a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    words = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    subprocess.run(words, check=True)


def change(folder, *options):
    """Give a disk another size, or make it read-only (``ro``) or writable (``rw``)."""
    subprocess.run(["mount", "-o", ",".join(["remount", *options]), folder], check=True)


def unmount(folder):
    subprocess.run(["umount", folder], check=True)


def room(folder):
    """Bytes that the files of a folder take on a disk."""
    sizes = (path.lstat().st_size for path in folder.rglob("*") if path.is_file())
    return sum(-(-size // BLOCK) * BLOCK for size in sizes)
