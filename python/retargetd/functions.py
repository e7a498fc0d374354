"""The engine as functions."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from . import _engine
from .files import Config, FileLike, Given, read, read_config, read_optional, read_rigs
from .results import Picture, Result, write_whole

Files = tuple[Given, Given, Given, Given, Given]
Rigs = Mapping[str, object] | list[Mapping[str, object]] | None

_MEDIA_TYPES = {
    "png": "image/png",
    "apng": "image/apng",
    "webp": "image/webp",
    "gif": "image/gif",
    "mp4": "video/mp4",
}


def retarget(
    source: FileLike,
    target: FileLike,
    config: Config = None,
    *,
    source_rest: FileLike | None = None,
    target_rest: FileLike | None = None,
    preset: str | None = None,
    rigs: Rigs = None,
    formats: Sequence[str] = ("glb",),
    isolate: bool = False,
) -> Result:
    """Puts the source's clip onto the target.

    What ``config`` leaves out is found out; docs/reference/config.md has every field. ``formats`` are made now and others when they
    are first asked for, by doing the work again. With ``isolate``, the engine works in a process of its own, so that a file
    which brings a decoder down raises an exception and nothing else.

    >>> import retargetd as rt
    >>> out = rt.retarget(*rt.samples(), {"edit": {"fps": 24}})
    >>> out.poses.fps
    24.0
    """
    files = _pair(source, target, source_rest, target_rest, read_config(config, preset))
    return _task("Retarget", files, formats, rigs, isolate)


def tune(
    source: FileLike,
    target: FileLike,
    config: Config = None,
    *,
    max_evaluations: int = 40,
    rigs: Rigs = None,
    formats: Sequence[str] = ("glb",),
    isolate: bool = False,
) -> Result:
    """Retargets with parameters that are searched for: ``report["tuning"]`` says what was gained, and ``resolved_spec`` has what
    was found, for other clips of the pair.

    >>> import retargetd as rt
    >>> tuning = rt.tune(*rt.samples(), max_evaluations=4).report["tuning"]
    >>> tuning["score_after"] <= tuning["score_before"]
    True
    """
    given = read_config(config)
    document = json.loads(_engine.merge_config("{}", given and given[1]))
    document["tune"] = {"max_evaluations": max_evaluations}
    return retarget(source, target, document, rigs=rigs, formats=formats, isolate=isolate)


def edit(
    source: FileLike,
    config: Config,
    *,
    source_rest: FileLike | None = None,
    rigs: Rigs = None,
    formats: Sequence[str] = ("glb",),
    isolate: bool = False,
) -> Result:
    """Edits one clip of a file and writes it back onto the file's own skeleton; ``config["edit"]`` says what is done.

    >>> import retargetd as rt
    >>> rt.edit(rt.samples()[0], {"edit": {"range": [0, 1]}}).poses.frame_count
    31
    """
    files = (read(source, "source"), None, read_optional(source_rest, "source_rest"), None, read_config(config))
    return _task("Edit", files, formats, rigs, isolate)


def pose(
    target: FileLike,
    to: str | FileLike = "t",
    config: Config = None,
    *,
    target_rest: FileLike | None = None,
    rigs: Rigs = None,
    formats: Sequence[str] = ("glb",),
    isolate: bool = False,
) -> Result:
    """Puts a character into a pose: ``"t"``, ``"a"``, ``"rest"`` (its own, with the config's edits), or that of another file.

    >>> import retargetd as rt
    >>> rt.pose(rt.samples()[1], "a").report["counts"]["frames"]
    1
    """
    choice = to if isinstance(to, str) and to in ("t", "a", "rest") else "source"
    model = None if choice != "source" else read(to, "source")
    files = (model, read(target, "target"), None, read_optional(target_rest, "target_rest"), read_config(config))
    return _task(json.dumps({"Pose": {"to": choice}}), files, formats, rigs, isolate)


def inspect(file: FileLike, *, rigs: Rigs = None, isolate: bool = False) -> dict[str, Any]:
    """Says what a file holds: skeletons, clips, the recognized rig, roles, rest pose, units, findings, warnings.

    >>> import retargetd as rt
    >>> rt.inspect(rt.samples()[1])["rigs"][0]["roles"]["pelvis"]
    'pelvis'
    """
    return _document('"Inspect"', (read(file, "source"), None, None, None, None), rigs, isolate)


def suggest(
    source: FileLike,
    target: FileLike,
    config: Config = None,
    *,
    source_rest: FileLike | None = None,
    target_rest: FileLike | None = None,
    rigs: Rigs = None,
    isolate: bool = False,
) -> dict[str, Any]:
    """Says what a retarget would do: for each role the joints of both sides and how sure that is, for each joint what drives it.
    ``resolved_spec`` is the config that does it.

    >>> import retargetd as rt
    >>> rt.suggest(*rt.samples())["counts"]["driven_joints"] > 15
    True
    """
    files = _pair(source, target, source_rest, target_rest, read_config(config))
    return _document('"Propose"', files, rigs, isolate)


def explain(
    source: FileLike,
    target: FileLike,
    frame: int,
    joint: str,
    config: Config = None,
    *,
    source_rest: FileLike | None = None,
    target_rest: FileLike | None = None,
    rigs: Rigs = None,
    isolate: bool = False,
) -> dict[str, Any]:
    """Says why a joint of the result is turned as it is at one frame.

    >>> import retargetd as rt
    >>> rt.explain(*rt.samples(), frame=10, joint="lowerarm_l")["driver"]
    'chain'
    """
    files = _pair(source, target, source_rest, target_rest, read_config(config))
    question = json.dumps({"Explain": {"frame": frame, "joint": joint}})
    return _document(question, files, rigs, isolate)


def check_config(config: Config) -> dict[str, Any]:
    """The config as it is understood; raises :class:`ConfigError` where it cannot be used.

    >>> import retargetd as rt
    >>> try:
    ...     rt.check_config({"algin": "off"})
    ... except rt.ConfigError as error:
    ...     print(error.pointer, error.errors[0].did_you_mean)
    /algin ('align',)
    """
    given = read_config(config) or ("config.json", b"{}")
    return _document('"CheckConfig"', (None, None, None, None, given), None, False)


def preview(
    file: FileLike,
    path: str | os.PathLike[str] | None = None,
    *,
    clip: str | None = None,
    ending: str = "webp",
    isolate: bool = False,
    **view: object,
) -> Picture:
    """Draws a file: its mesh, or where it has none a body of capsules. ``ending`` (or that of ``path``, where it is written to) picks
    ``png``, ``webp``, ``gif``, ``apng`` or ``mp4``; ``view`` is how it is seen, as ``size=256``, ``camera="side"``, ``fps=12``,
    ``at_seconds=1.5``, ``style="skeleton"``, ``background="dark"``.

    >>> import retargetd as rt
    >>> rt.preview(rt.samples()[1], ending="png", size=64)[:4]
    b'\\x89PNG'
    """
    kind, options = _view(path, clip, ending, view)
    files: Files = (read(file, "source"), None, None, None, None)
    answer = _engine.ask(json.dumps({"Preview": options}), files, [], [], isolate)
    return _picture(answer, kind, path)


def compare(
    first: FileLike,
    second: FileLike,
    path: str | os.PathLike[str] | None = None,
    *,
    clip: str | None = None,
    ending: str = "webp",
    **view: object,
) -> Picture:
    """Draws two files at one scale and the same time, beside one another, or with ``layout="ghost"`` the first through the second."""
    kind, options = _view(path, clip, ending, view)
    return _picture(_engine.compare(read(first, "source"), read(second, "source"), json.dumps(options)), kind, path)


def draw(
    scene: str | os.PathLike[str] | None = None,
    path: str | os.PathLike[str] | None = None,
    *,
    drawing: str | os.PathLike[str] | None = None,
    motion: FileLike | None = None,
    clip: str | None = None,
    ending: str = "webp",
    compat: bool = False,
) -> Picture:
    """Has a drawn character move: a scene of *Animated Drawings*, or a folder with a ``drawing`` and a ``motion``. With ``compat``,
    the numbers of that program come out, with all that it does otherwise than one would."""
    kind = Path(path).suffix.lstrip(".").lower() if path is not None else ending
    given = read_optional(motion, "source")
    data, _ = _engine.draw(_path(scene), _path(drawing), given, clip, kind, compat)
    return _picture(data, kind, path)


def formats() -> list[dict[str, Any]]:
    """Every format: its name, endings, and whether it is read and written.

    >>> import retargetd as rt
    >>> [known["name"] for known in rt.formats() if known["reads"]][:3]
    ['glb', 'gltf', 'vrm']
    """
    listed: list[dict[str, Any]] = json.loads(_engine.formats())
    return listed


def rigs() -> dict[str, dict[str, Any]]:
    """The rig templates that are built in, by name."""
    templates: dict[str, dict[str, Any]] = json.loads(_engine.built_in_rigs())
    return templates


def presets() -> dict[str, dict[str, Any]]:
    """The presets that are built in, by name.

    >>> import retargetd as rt
    >>> rt.presets()["plain_fk"]
    {'ops': [{'op': 'pelvis'}, {'op': 'fk'}]}
    """
    documents: dict[str, dict[str, Any]] = json.loads(_engine.built_in_presets())
    return documents


def schema(of: str = "config") -> dict[str, Any]:
    """The JSON Schema of a config, or with ``"rig"`` of a rig template."""
    if of not in ("config", "rig"):
        raise ValueError("there are schemas of 'config' and of 'rig'")
    document: dict[str, Any] = json.loads(_engine.rig_schema() if of == "rig" else _engine.config_schema())
    return document


def samples() -> tuple[bytes, bytes]:
    """A clip and a character to try things with, as GLB."""
    return _engine.samples()


def version() -> str:
    """The version of the engine."""
    return _engine.version()


def _pair(
    source: FileLike, target: FileLike, source_rest: FileLike | None, target_rest: FileLike | None, config: Given
) -> Files:
    return (
        read(source, "source"),
        read(target, "target"),
        read_optional(source_rest, "source_rest"),
        read_optional(target_rest, "target_rest"),
        config,
    )


def _task(question: str, files: Files, formats: Sequence[str], rigs: Rigs, isolate: bool) -> Result:
    asked = question if question.startswith("{") else json.dumps(question)
    templates = read_rigs(rigs)

    def again(wanted: Sequence[str]) -> _engine.Ran:
        answer = _engine.ask(asked, files, list(wanted), templates, isolate)
        assert isinstance(answer, _engine.Ran)
        return answer

    return Result(again([formats] if isinstance(formats, str) else formats), again)


def _document(question: str, files: Files, rigs: Rigs, isolate: bool) -> dict[str, Any]:
    answer = _engine.ask(question, files, [], read_rigs(rigs), isolate)
    assert isinstance(answer, str)
    document: dict[str, Any] = json.loads(answer)
    return document


def _view(
    path: str | os.PathLike[str] | None, clip: str | None, ending: str, view: Mapping[str, object]
) -> tuple[str, dict[str, object]]:
    kind = Path(path).suffix.lstrip(".").lower() if path is not None else ending
    seen = {name: value for name, value in view.items() if value is not None}
    if isinstance(seen.get("size"), int):
        seen["size"] = [seen["size"], seen["size"]]
    return kind, {"view": seen, "ending": kind, "clip": clip}


def _picture(answer: object, kind: str, path: str | os.PathLike[str] | None) -> Picture:
    assert isinstance(answer, bytes)
    if path is not None:
        write_whole(path, answer)
    return Picture(answer, _MEDIA_TYPES.get(kind, "application/octet-stream"))


def _path(place: str | os.PathLike[str] | None) -> Path | None:
    return None if place is None else Path(place)
