"""A file that appears whole or not at all, for the scripts beside this one."""

from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(path):
    """Opens a file for writing. It replaces the file at `path` only when the block has ended without an exception."""
    new = Path(f"{path}.new")
    try:
        with new.open("w", newline="") as file:
            yield file
        new.replace(path)
    finally:
        new.unlink(missing_ok=True)
