"""The parts of the Blender add-on that need no Blender; `blender/check.py` runs the rest in Blender itself."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import zipfile
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import retargetd as rt

from conftest import PYTHON

ADDON = PYTHON / "blender/retargetd_blender"


def part(name: str) -> ModuleType:
    """One file of the add-on, without those that need Blender."""
    spec = importlib.util.spec_from_file_location(f"addon_{name}", ADDON / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_matrices_go_to_arrays_and_back() -> None:
    armatures = part("armatures")
    random = np.random.default_rng(7)
    parents = np.array([-1, 0, 1, 1, -1])
    turns = random.normal(size=(9, 5, 4))
    turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
    local = np.zeros((9, 5, 4, 4))
    local[..., :3, :3] = armatures.rotation_matrices(turns) * random.uniform(0.5, 2, (9, 5, 1, 1))
    local[..., :3, 3] = random.normal(size=(9, 5, 3))
    local[..., 3, 3] = 1
    model = local.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            model[:, joint] = model[:, parent] @ local[:, joint]
    object_matrix = np.eye(4)
    object_matrix[:3, :3] = armatures.rotation_matrices([0.5, 0.5, 0.5, 0.5]) * 0.01
    object_matrix[:3, 3] = (1, 2, 3)
    world = armatures.world_of(object_matrix, 1.0)
    arrays = armatures.local_of(model, parents, world)
    _, back = armatures.matrices_of(*arrays, parents, world)
    assert np.abs(back - model).max() < 1e-4
    roots = (object_matrix @ model[:, 0])[:, :3, 3]
    assert np.abs(arrays[0][:, 0] - roots).max() < 1e-5, "roots are in the world"
    for name, matrix in (("scaled", np.diag([1.0, 2, 1, 1])), ("mirrored", np.diag([-1.0, 1, 1, 1]))):
        with pytest.raises(armatures.Unusable, match=name):
            armatures.world_of(matrix, 1.0)


def test_quaternions_are_those_of_matrices() -> None:
    armatures = part("armatures")
    turns = np.random.default_rng(3).normal(size=(500, 4))
    turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
    back = armatures.quaternions_of(armatures.rotation_matrices(turns))
    assert np.abs(np.abs(np.sum(back * turns, axis=-1)) - 1).max() < 1e-12


def test_the_service_takes_what_blender_sends(service: str, walk: bytes, mannequin: bytes) -> None:
    """Arrays of a scene whose up axis is Z and whose figures look along -Y, as form parts."""
    npz, transport = part("npz"), part("service")

    def arrays(poses: rt.Poses) -> dict[str, Any]:
        return {
            "joint_names": np.array(poses.joint_names),
            "parents": poses.parents,
            **{f"rest_{key}": getattr(poses, f"rest_{key}") for key in ("translations", "rotations", "scales")},
            **{key: getattr(poses, key) for key in ("times", "translations", "rotations", "scales")},
            "meta": {"name": "walk", "axes": poses.axes, "unit": 1.0},
        }

    target = rt.pose(mannequin, "rest").poses
    files = [
        ("source", "walk.npz", npz.encode(arrays(rt.Poses.read(walk)))),
        ("target", "mannequin.npz", npz.encode(arrays(target.frames(0, 0)))),
    ]
    client = transport.Service(service)
    assert client.is_ready()
    told: list[str] = []
    data, report = client.retarget(files, {"output": {"format": "poses_npz"}}, lambda: False, told.append)
    made = npz.decode(data)
    assert made["rotations"].shape[0] == 121 and list(made["joint_names"]) == list(target.joint_names)
    assert report["measures"]["verdict"] in ("pass", "warn")
    assert {role["role"] for role in client.suggest(files, None)["roles"]} >= {"pelvis", "head"}
    with pytest.raises(transport.Refused, match="algin"):
        client.retarget(files, {"algin": "off"}, lambda: False)
    with pytest.raises(transport.Refused, match="does not answer"):
        transport.Service("http://127.0.0.1:9").presets()


def test_work_in_the_background_ends_in_words() -> None:
    transport = part("service")

    def refuse(_is_canceled: Any, _tell: Any) -> None:
        raise transport.Refused("no")

    def wait(is_canceled: Any, tell: Any) -> str:
        tell("waits")
        while not is_canceled():
            pass
        return "canceled"

    refused, waiting = transport.Task(refuse), transport.Task(wait)
    waiting.cancel()
    for task in (refused, waiting):
        task._thread.join(10)
        assert task.is_done()
    assert (refused.error, waiting.result, waiting.told) == ("no", "canceled", "waits")


def test_the_archive_is_small_and_says_what_it_is(tmp_path: Path) -> None:
    archive = tmp_path / "addon.zip"
    subprocess.run([sys.executable, PYTHON / "blender/build", archive], check=True)
    assert archive.stat().st_size <= 100_000
    with zipfile.ZipFile(archive) as file:
        names = set(file.namelist())
        manifest = file.read("blender_manifest.toml").decode()
        license_text = file.read("LICENSE").decode()
    assert names == {path.name for path in ADDON.iterdir() if path.is_file()}
    for line in ('schema_version = "1.0.0"', 'id = "retargetd"', 'type = "add-on"', 'blender_version_min = "4.2.0"'):
        assert line in manifest.splitlines()
    assert 'license = ["SPDX:GPL-3.0-or-later"]' in manifest and "GNU GENERAL PUBLIC LICENSE" in license_text
    if sys.version_info >= (3, 11):
        import tomllib

        fields = tomllib.loads(manifest)
        assert len(fields["tagline"]) <= 64 and fields["tagline"][-1].isalnum()
        assert all(len(why) <= 64 and why[-1].isalnum() for why in fields["permissions"].values()), fields["permissions"]
    for path in ADDON.glob("*.py"):
        assert path.read_text(encoding="utf-8").startswith("# SPDX-License-Identifier: GPL-3.0-or-later\n"), path
