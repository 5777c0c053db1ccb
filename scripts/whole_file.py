"""A file that appears whole or not at all, for the scripts beside this one."""

from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(path):
    """To write in. What lies at `path` stays as it is until the block has ended well."""
    new = Path(f"{path}.new")
    try:
        with new.open("w", newline="") as file:
            yield file
        new.replace(path)
    finally:
        new.unlink(missing_ok=True)
