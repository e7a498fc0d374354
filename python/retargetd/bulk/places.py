"""Where results go: a folder, or what fsspec knows (S3 and others)."""

from __future__ import annotations

import os
import uuid
from pathlib import Path
from typing import Any, Protocol


class Place(Protocol):
    """Files under names with slashes. A file is there whole or not at all."""

    def put(self, name: str, data: bytes) -> None: ...
    def get(self, name: str) -> bytes: ...
    def names(self, folder: str) -> set[str]: ...


class Folder:
    """A folder of this machine."""

    def __init__(self, root: str) -> None:
        self._root = Path(root)

    def put(self, name: str, data: bytes) -> None:
        path = self._root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        staged = path.with_name(f".{path.name}.{os.getpid()}.{uuid.uuid4().hex}.part")
        try:
            staged.write_bytes(data)
            os.replace(staged, path)
        finally:
            staged.unlink(missing_ok=True)

    def get(self, name: str) -> bytes:
        return (self._root / name).read_bytes()

    def names(self, folder: str) -> set[str]:
        place = self._root / folder
        return {path.name for path in place.iterdir() if path.name[0] != "."} if place.is_dir() else set()


class Remote:
    """What fsspec knows; object stores put an object whole or not at all."""

    def __init__(self, root: str) -> None:
        try:
            import fsspec
        except ImportError:
            raise ModuleNotFoundError(
                f"'{root}' needs fsspec, and for S3 s3fs: pip install 'retargetd[bulk]' s3fs"
            ) from None
        self._files: Any
        self._files, self._root = fsspec.core.url_to_fs(root)

    def put(self, name: str, data: bytes) -> None:
        path = f"{self._root}/{name}"
        self._files.makedirs(path.rsplit("/", 1)[0], exist_ok=True)
        self._files.pipe_file(path, data)

    def get(self, name: str) -> bytes:
        content: bytes = self._files.cat_file(f"{self._root}/{name}")
        return content

    def names(self, folder: str) -> set[str]:
        path = f"{self._root}/{folder}"
        self._files.invalidate_cache()
        if not self._files.exists(path):
            return set()
        return {str(found).rsplit("/", 1)[-1] for found in self._files.ls(path, detail=False)}


def place_of(output: str | os.PathLike[str]) -> Place:
    """The place that a path or an address names."""
    text = os.fspath(output)
    return Remote(text) if "://" in text else Folder(text)


def read_input(path: str) -> Any:
    """What a cell of the table names, as the engine takes it: a path, or the bytes of an address."""
    if "://" not in path:
        return Path(path)
    import fsspec

    from ..files import File

    with fsspec.open(path, "rb") as file:
        return File(path.rsplit("/", 1)[-1], file.read())
