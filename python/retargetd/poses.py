"""Pose arrays: a skeleton and its motion as NumPy arrays."""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from .files import FileLike

Floats = NDArray[np.float32]

# NumPy's archives have the time of day in them; the same poses give the same bytes.
_NO_TIME = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True, eq=False)
class Poses:
    """A skeleton of J joints and F frames of it. Rotations are ``x y z w``; everything is local, relative to the parent.

    The arrays are those of an NPZ that the command line or the service writes, and that NPZ can be made of it again.

    >>> import numpy as np, retargetd as rt
    >>> walk = rt.Poses.read(rt.samples()[0])
    >>> walk.rotations.shape == (walk.frame_count, walk.joint_count, 4)
    True
    >>> np.allclose(walk.global_positions()[0, 0], walk.translations[0, 0])
    True
    """

    joint_names: tuple[str, ...]
    parents: NDArray[np.int32]
    """Index of each joint's parent; -1 for a root. Parents come before children."""
    rest_translations: Floats
    rest_rotations: Floats
    rest_scales: Floats
    times: NDArray[Any]
    """Seconds, rising."""
    translations: Floats
    """F x J x 3."""
    rotations: Floats
    """F x J x 4."""
    scales: Floats
    """F x J x 3."""
    contact_joints: tuple[str, ...] = ()
    contacts: NDArray[np.bool_] | None = None
    """F x C: when those joints rest on something; ``None`` where nothing is known of it."""
    morph_names: tuple[str, ...] = ()
    morph_weights: Floats | None = None
    """F x M."""
    name: str = ""
    axes: str = "+y+z"
    """Up and front."""
    unit: float = 1.0
    """Meters per unit of length."""
    meta: Mapping[str, object] = field(default_factory=dict)
    """Everything that an archive says beside its arrays."""

    @classmethod
    def of(
        cls,
        joint_names: Sequence[str],
        parents: ArrayLike,
        rest_translations: ArrayLike,
        rotations: ArrayLike,
        *,
        times: ArrayLike | None = None,
        fps: float = 30.0,
        translations: ArrayLike | None = None,
        scales: ArrayLike | None = None,
        rest_rotations: ArrayLike | None = None,
        rest_scales: ArrayLike | None = None,
        name: str = "",
        axes: str = "+y+z",
        unit: float = 1.0,
    ) -> Poses:
        """Poses of arrays that you have; what is left out is at rest, and without ``times`` frame k is at k / ``fps``."""
        count = len(joint_names)
        turned = np.ascontiguousarray(rotations, np.float32)
        if turned.ndim != 3 or turned.shape[1:] != (count, 4):
            raise ValueError(f"rotations: the shape is {turned.shape} where (frames, {count}, 4) is needed")
        frames = turned.shape[0]
        ones = np.ones((count, 3), np.float32)
        identity = np.tile(np.array([0, 0, 0, 1], np.float32), (count, 1))
        rest = _shaped("rest_translations", rest_translations, (count, 3))
        scale = ones if rest_scales is None else _shaped("rest_scales", rest_scales, (count, 3))
        moved = np.broadcast_to(rest, (frames, count, 3)) if translations is None else translations
        scaled = np.broadcast_to(scale, (frames, count, 3)) if scales is None else scales
        return cls(
            joint_names=tuple(joint_names),
            parents=np.ascontiguousarray(parents, np.int32),
            rest_translations=rest,
            rest_rotations=identity
            if rest_rotations is None
            else _shaped("rest_rotations", rest_rotations, (count, 4)),
            rest_scales=scale,
            times=np.arange(frames) / fps if times is None else np.ascontiguousarray(times, np.float64),
            translations=_shaped("translations", moved, (frames, count, 3)),
            rotations=turned,
            scales=_shaped("scales", scaled, (frames, count, 3)),
            name=name,
            axes=axes,
            unit=unit,
        )

    @classmethod
    def read(cls, file: FileLike, clip: str | None = None) -> Poses:
        """A clip of any file that can be read; without a name, the first that moves."""
        from .functions import edit

        config: dict[str, object] = {"report": "none"}
        if clip is not None:
            config["clip"] = clip
        return edit(file, config, formats=["npz"]).poses

    @classmethod
    def from_npz(cls, file: str | os.PathLike[str] | bytes) -> Poses:
        """Reads an archive as it is, without asking the engine."""
        data = file if isinstance(file, bytes) else Path(file).read_bytes()
        arrays = _members(data)
        meta = json.loads(str(arrays["meta"])) if "meta" in arrays else {}
        count = len(arrays["joint_names"])
        frames = len(arrays["times"]) if "times" in arrays else len(arrays["rotations"])
        rest = {
            "rest_translations": arrays["rest_translations"],
            "rest_rotations": arrays.get(
                "rest_rotations", np.tile(np.array([0, 0, 0, 1], np.float32), (count, 1))
            ),
            "rest_scales": arrays.get("rest_scales", np.ones((count, 3), np.float32)),
        }
        moving = {
            key: arrays[key] if key in arrays else np.broadcast_to(rest[f"rest_{key}"], (frames, count, width))
            for key, width in (("translations", 3), ("rotations", 4), ("scales", 3))
        }
        return cls(
            joint_names=tuple(str(name) for name in arrays["joint_names"]),
            parents=arrays["parents"],
            **rest,
            times=arrays["times"] if "times" in arrays else np.arange(frames) / float(meta.get("fps", 30)),
            **moving,
            contact_joints=tuple(str(name) for name in arrays.get("contact_joints", ())),
            contacts=arrays.get("contacts"),
            morph_names=tuple(str(name) for name in arrays.get("morph_names", ())),
            morph_weights=arrays.get("morph_weights"),
            name=str(meta.get("name", "")),
            axes=str(meta.get("axes", "+y+z")),
            unit=float(meta.get("unit", 1.0)),
            meta=meta,
        )

    def to_npz(self, path: str | os.PathLike[str]) -> None:
        """Writes an archive that every tool here reads."""
        Path(path).write_bytes(self.to_bytes())

    def to_bytes(self) -> bytes:
        """The archive as bytes; the same poses give the same ones."""
        meta = {**self.meta, "name": self.name, "axes": self.axes, "unit": self.unit}
        arrays: dict[str, NDArray[Any]] = {
            "joint_names": np.array(self.joint_names, dtype=np.str_),
            "parents": np.ascontiguousarray(self.parents, np.int32),
            "rest_translations": np.ascontiguousarray(self.rest_translations, np.float32),
            "rest_rotations": np.ascontiguousarray(self.rest_rotations, np.float32),
            "rest_scales": np.ascontiguousarray(self.rest_scales, np.float32),
            "times": np.asarray(self.times),
            "translations": np.ascontiguousarray(self.translations, np.float32),
            "rotations": np.ascontiguousarray(self.rotations, np.float32),
            "scales": np.ascontiguousarray(self.scales, np.float32),
        }
        if self.contacts is not None:
            arrays["contact_joints"] = np.array(self.contact_joints, dtype=np.str_)
            arrays["contacts"] = np.ascontiguousarray(self.contacts, np.bool_)
        if self.morph_weights is not None:
            arrays["morph_names"] = np.array(self.morph_names, dtype=np.str_)
            arrays["morph_weights"] = np.ascontiguousarray(self.morph_weights, np.float32)
        arrays["meta"] = np.array(json.dumps(meta))
        return _archive(arrays)

    @property
    def frame_count(self) -> int:
        """F."""
        return int(self.rotations.shape[0])

    @property
    def joint_count(self) -> int:
        """J."""
        return len(self.joint_names)

    @property
    def fps(self) -> float | None:
        """Frames per second where they are evenly spaced."""
        if self.frame_count < 2:
            return None
        steps = np.diff(np.asarray(self.times, np.float64))
        step = float(steps.mean())
        even = step > 0 and bool(np.all(np.abs(steps - step) < max(step * 1e-2, 1e-6)))
        return round(1 / step, 3) if even else None

    def joint(self, name: str) -> int:
        """Index of the joint of that name."""
        try:
            return self.joint_names.index(name)
        except ValueError:
            raise KeyError(f"there is no joint '{name}'") from None

    def frames(self, first: int, last: int) -> Poses:
        """The frames from ``first`` up to ``last``, without that; the arrays are views of these."""
        part = slice(first, last)
        return replace(
            self,
            times=self.times[part],
            translations=self.translations[part],
            rotations=self.rotations[part],
            scales=self.scales[part],
            contacts=None if self.contacts is None else self.contacts[part],
            morph_weights=None if self.morph_weights is None else self.morph_weights[part],
        )

    def global_positions(self) -> Floats:
        """F x J x 3: where the joints are in model space."""
        return self._model()[0]

    def global_matrices(self) -> Floats:
        """F x J x 3 x 3: how the joints are turned and scaled in model space."""
        return self._model()[1]

    def _model(self) -> tuple[Floats, Floats]:
        local = matrices(self.rotations) * self.scales[..., None, :]
        places = np.empty((self.frame_count, self.joint_count, 3))
        turned = np.empty((self.frame_count, self.joint_count, 3, 3))
        for joint, parent in enumerate(self.parents):
            if parent < 0:
                places[:, joint] = self.translations[:, joint]
                turned[:, joint] = local[:, joint]
                continue
            above = turned[:, parent]
            offset = np.einsum("fij,fj->fi", above, self.translations[:, joint].astype(np.float64))
            places[:, joint] = places[:, parent] + offset
            turned[:, joint] = above @ local[:, joint]
        return places.astype(np.float32), turned.astype(np.float32)

    def __len__(self) -> int:
        return self.frame_count

    def __repr__(self) -> str:
        rate = f", {self.fps:g} fps" if self.fps else ""
        return f"<Poses '{self.name}': {self.frame_count} frames, {self.joint_count} joints{rate}>"


def _archive(arrays: dict[str, NDArray[Any]]) -> bytes:
    """An NPZ of arrays, stored."""
    room = io.BytesIO()
    archive = zipfile.ZipFile(room, "w")
    try:
        for key, array in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{key}.npy", _NO_TIME), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
        archive.close()
    except BaseException:
        # Closing what Ctrl-C left unfinished fails, now or when it is freed, and that would hide the interrupt.
        archive.fp = None
        raise
    return room.getvalue()


def matrices(rotations: ArrayLike) -> NDArray[np.float64]:
    """Rotation matrices of quaternions ``x y z w``.

    >>> matrices([0, 0, 0, 1]).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    x, y, z, w = np.moveaxis(np.asarray(rotations, np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _shaped(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Floats:
    array = np.ascontiguousarray(values, np.float32)
    if array.shape != shape:
        raise ValueError(f"{name}: the shape is {array.shape} where {shape} is needed")
    return array


def _members(data: bytes) -> dict[str, Any]:
    """The arrays of an archive. What is stored as it is (rotations are) stays where it is
    when it lies there as processors like it: the array is a view of ``data``."""
    arrays: dict[str, Any] = {}
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for info in archive.infolist():
            key = info.filename.removesuffix(".npy")
            if info.compress_type == zipfile.ZIP_STORED:
                # Behind the local header, whose two lengths say how long its names are.
                head = info.header_offset + 26
                names = int.from_bytes(data[head : head + 2], "little") + int.from_bytes(
                    data[head + 2 : head + 4], "little"
                )
                begin = info.header_offset + 30 + names
                content: bytes | memoryview = memoryview(data)[begin : begin + info.file_size]
            else:
                content = archive.read(info)
            arrays[key] = _array(content)
    return arrays


def _array(content: bytes | memoryview) -> NDArray[Any]:
    head = io.BytesIO(bytes(content[:65536]))
    version = np.lib.format.read_magic(head)
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, by_columns, kind = read_header(head)
    if kind.hasobject:
        raise ValueError("an array holds objects of Python, which are not read")
    count = int(np.prod(shape, dtype=np.int64))
    values = np.frombuffer(content, kind, count, head.tell())
    if not values.flags.aligned:
        values = values.copy()
    return values.reshape(shape, order="F" if by_columns else "C")
