"""A retarget compiled once, for many motions of one pair of rigs."""

from __future__ import annotations

import json
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _engine
from .files import Config, FileLike, read, read_config, read_optional, read_rigs
from .functions import Rigs
from .poses import Poses
from .results import Warned


class Plan:
    """A retarget of one pair of rigs with one config, compiled: poses in, poses out, no files.

    Nothing is measured, and what changes whole clips (``edit``, ``layer``, ``morphs``) is not done. A plan is safe to run from
    several threads at once.

    >>> import retargetd as rt
    >>> walk, mannequin = rt.samples()
    >>> plan = rt.Plan(walk, mannequin)
    >>> result = plan.run(rt.Poses.read(walk))
    >>> result.rotations.shape == (121, plan.target.joint_count, 4)
    True
    """

    def __init__(
        self,
        source_rig: FileLike,
        target_rig: FileLike,
        config: Config = None,
        *,
        source_rest: FileLike | None = None,
        target_rest: FileLike | None = None,
        preset: str | None = None,
        rigs: Rigs = None,
    ) -> None:
        files = (
            read(source_rig, "source"),
            read(target_rig, "target"),
            read_optional(source_rest, "source_rest"),
            read_optional(target_rest, "target_rest"),
            read_config(config, preset),
        )
        self._plan = _engine.Plan(files, read_rigs(rigs))

    @cached_property
    def source(self) -> Poses:
        """The source's skeleton: poses without frames. Arrays that are run have its joints in this order."""
        return _skeleton(self._plan.source)

    @cached_property
    def target(self) -> Poses:
        """The target's skeleton: poses without frames."""
        return _skeleton(self._plan.target)

    @cached_property
    def facts(self) -> dict[str, Any]:
        """What was found out of the two rigs."""
        facts: dict[str, Any] = json.loads(self._plan.facts)
        return facts

    @property
    def resolved_spec(self) -> dict[str, Any]:
        """The config with everything found out filled in."""
        spec: dict[str, Any] = self.facts["resolved_spec"]
        return spec

    @property
    def warnings(self) -> tuple[Warned, ...]:
        """Guesses."""
        return tuple(
            Warned(warning["code"], warning["place"], warning["detail"], warning["hint"])
            for warning in self.facts["warnings"]
        )

    def run(self, poses: Poses) -> Poses:
        """Retargets poses of the source; those of a longer file may have its joints in another order."""
        order = self._order(poses)
        if order is None:
            translations, rotations, scales = poses.translations, poses.rotations, poses.scales
        else:
            translations, rotations, scales = (
                poses.translations[:, order],
                poses.rotations[:, order],
                poses.scales[:, order],
            )
        made = self.run_arrays(poses.times, rotations, translations, scales)
        skeleton = self.target
        return Poses(
            joint_names=skeleton.joint_names,
            parents=skeleton.parents,
            rest_translations=skeleton.rest_translations,
            rest_rotations=skeleton.rest_rotations,
            rest_scales=skeleton.rest_scales,
            times=poses.times,
            translations=made[0],
            rotations=made[1],
            scales=made[2],
            name=poses.name,
            axes=skeleton.axes,
            unit=skeleton.unit,
        )

    def run_arrays(
        self,
        times: ArrayLike,
        rotations: ArrayLike,
        translations: ArrayLike | None = None,
        scales: ArrayLike | None = None,
    ) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]]:
        """The same on plain arrays (F, F x J x 4, F x J x 3, F x J x 3), for who has no need of :class:`Poses`; gives translations,
        rotations and scales. Arrays that lie in one piece as 32-bit floats are not copied."""

        def whole(values: ArrayLike | None) -> np.ndarray[Any, np.dtype[np.float32]] | None:
            return None if values is None else np.require(values, np.float32, ["C", "A"])

        turned = whole(rotations)
        assert turned is not None
        return self._plan.run(np.require(times, np.float64, ["C", "A"]), whole(translations), turned, whole(scales))

    def _order(self, poses: Poses) -> list[int] | None:
        wanted = self.source
        if (poses.axes, poses.unit) != (wanted.axes, wanted.unit):
            raise ValueError(
                f"the poses are in {poses.axes} and units of {poses.unit} m where the plan takes {wanted.axes} and {wanted.unit} m"
            )
        if poses.joint_names == wanted.joint_names:
            return None
        places = {name: place for place, name in enumerate(poses.joint_names)}
        missing = [name for name in wanted.joint_names if name not in places]
        if missing:
            raise ValueError(f"the poses lack joints of the source: {', '.join(missing[:5])}")
        return [places[name] for name in wanted.joint_names]

    def __repr__(self) -> str:
        driven = self.facts["driven_joints"]
        return f"<Plan: {self.source.joint_count} joints drive {driven} of {self.target.joint_count}>"


def _skeleton(layout: tuple[Any, ...]) -> Poses:
    names, parents, translations, rotations, scales, axes, unit = layout
    none = np.empty((0, len(names), 3), np.float32)
    return Poses(
        joint_names=tuple(names),
        parents=np.array(parents, np.int32),
        rest_translations=translations,
        rest_rotations=rotations,
        rest_scales=scales,
        times=np.empty(0),
        translations=none,
        rotations=np.empty((0, len(names), 4), np.float32),
        scales=none,
        axes=axes,
        unit=unit,
    )
