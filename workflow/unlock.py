"""Remove the lock that a killed Snakemake left in a folder, so that the next run goes on by itself.

``python workflow/unlock.py [FOLDER]``.  Snakemake's lock does not say who holds it.  It is stale where no process of
Snakemake, neither the program nor one of its jobs, works in the folder; while one does, it is kept, and this fails.
"""

import os
import shutil
import sys
from pathlib import Path

LOCKS = Path(".snakemake/locks")


def running(folder: Path) -> list[int]:
    """Ids of the processes of Snakemake that work in a folder."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().decode(errors="replace").split("\0")
            # The name of the program, of its module, or of a script that it runs in a process of its own.
            named = any(Path(word).name == "snakemake" or "/.snakemake/scripts/" in word for word in words[:4])
            if named and (process / "cwd").resolve(strict=True) == folder:
                found.append(int(process.name))
        except OSError:  # it has ended, or is somebody else's
            continue
    return sorted(found)


def unlock(folder: Path) -> str:
    """Remove the lock of a folder; what was done, empty where there was none.

    Raises RuntimeError: Snakemake runs there.
    """
    folder = folder.resolve()
    locks = folder / LOCKS
    if not locks.is_dir() or not any(locks.iterdir()):
        return ""
    if holders := running(folder):
        ids = ", ".join(map(str, holders))
        raise RuntimeError(f"a run is under way in {folder} (process {ids}): wait for it, or end it, and start again")
    shutil.rmtree(locks)
    return f"removed the lock of a run that was killed in {folder}"


def remove_half_written(*folders: str | Path) -> None:
    """Remove the temporary files that a killed run left in folders, in which nothing else may be writing."""
    for folder in folders:
        for half_written in Path(folder).rglob(".stripfold-*"):
            shutil.rmtree(half_written)


if __name__ == "__main__":
    try:
        if done := unlock(Path(sys.argv[1] if len(sys.argv) > 1 else os.curdir)):
            print(done, file=sys.stderr)
    except RuntimeError as error:
        print(f"unlock: {error}", file=sys.stderr)
        sys.exit(1)
