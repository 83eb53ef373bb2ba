"""Files that are written whole or not at all."""
import os
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import Iterator

from .data import DataError


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A temporary path to write to, of a new file that nobody else could have put there; renamed to `path` on
    success."""
    partial = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, name = tempfile.mkstemp(prefix=f'.{path.name}.', suffix='.partial', dir=path.parent)
        os.close(descriptor)
        partial = Path(name)
        yield partial
        mask = os.umask(0)
        os.umask(mask)
        partial.chmod(0o666 & ~mask)
        os.replace(partial, path)
    except OSError as error:
        raise DataError(path, f'cannot be written: {error.strerror or error}') from error
    finally:
        if partial is not None and partial.exists():
            partial.unlink()
