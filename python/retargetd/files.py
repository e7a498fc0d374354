"""Files as users give them: paths, bytes, poses, results."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Union

from . import _engine

if TYPE_CHECKING:
    from .poses import Poses
    from .results import Result


class File(NamedTuple):
    """Bytes with a name; only the ending of the name matters, and only where the bytes do not say what they are."""

    name: str
    data: bytes


FileLike = Union[str, "os.PathLike[str]", bytes, bytearray, memoryview, File, "Poses", "Result"]
"""What is taken wherever a file is asked for."""

Config = Union[Mapping[str, object], str, "os.PathLike[str]", bytes, bytearray, File, None]
"""What is taken wherever a config is asked for: its fields, or a file with JSON, YAML or a config of another tool."""

Given = Union["tuple[str, bytes]", None]


def read(file: FileLike, part: str) -> tuple[str, bytes]:
    """The name and the bytes of a file; ``part`` is what it is for."""
    if isinstance(file, File):
        return file.name, bytes(file.data)
    if isinstance(file, bytes):
        return "", file
    if isinstance(file, (bytearray, memoryview)):
        return "", bytes(file)
    if isinstance(file, (str, os.PathLike)):
        path = Path(file)
        return path.name, _engine.read_file(path, part)
    from .poses import Poses
    from .results import Result

    if isinstance(file, Poses):
        return "poses.npz", file.to_bytes()
    if isinstance(file, Result):
        output = file.outputs[0]
        return output.name, output.data
    raise TypeError(f"{part}: a path, bytes or Poses are needed, not {type(file).__name__}")


def read_optional(file: FileLike | None, part: str) -> Given:
    """The same for a file that may be left out."""
    return None if file is None else read(file, part)


def read_config(config: Config, preset: str | None = None) -> Given:
    """The name and the bytes of a config, laid over a preset where one is named."""
    given: Given
    if config is None:
        given = None
    elif isinstance(config, Mapping):
        given = ("config.json", json.dumps(config).encode())
    elif isinstance(config, (str, os.PathLike, bytes, bytearray, File)):
        given = read(config, "config")
    else:
        raise TypeError(f"config: a mapping, a path or bytes are needed, not {type(config).__name__}")
    if preset is None:
        return given
    presets = json.loads(_engine.built_in_presets())
    if preset not in presets:
        raise ValueError(f"there is no preset '{preset}'; there are {', '.join(presets)}")
    return "config.json", _engine.merge_config(json.dumps(presets[preset]), given and given[1]).encode()


def read_rigs(rigs: Mapping[str, object] | list[Mapping[str, object]] | None) -> list[str]:
    """Rig templates as JSON."""
    if rigs is None:
        return []
    templates = [rigs] if isinstance(rigs, Mapping) else rigs
    return [json.dumps(template) for template in templates]
