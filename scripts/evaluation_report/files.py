"""Files that are written whole or not at all."""
import os
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator

from .data import DataError


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A temporary path to write to; renamed to `path` on success."""
    partial = path.with_name(f'.{path.name}.partial')
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield partial
        os.replace(partial, path)
    except OSError as error:
        raise DataError(path, f'cannot be written: {error.strerror or error}') from error
    finally:
        if partial.exists():
            partial.unlink()
