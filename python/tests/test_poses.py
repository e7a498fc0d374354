"""Pose arrays: those of the archive, and what can be done with them."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
import retargetd as rt


def test_arrays_are_those_of_the_archive(walk: bytes, mannequin: bytes) -> None:
    out = rt.retarget(walk, mannequin, formats=["npz"])
    poses = out.poses
    with np.load(io.BytesIO(out.data)) as archive:
        for key in ("parents", "rest_translations", "rest_rotations", "rest_scales", "times"):
            assert np.array_equal(getattr(poses, key), archive[key]), key
        for key in ("translations", "rotations", "scales", "contacts"):
            assert np.array_equal(getattr(poses, key), archive[key]), key
            assert getattr(poses, key).dtype == archive[key].dtype, key
        assert list(poses.joint_names) == list(archive["joint_names"])
        assert list(poses.contact_joints) == list(archive["contact_joints"])
        assert poses.rotations.flags.aligned and poses.rotations.flags.c_contiguous


def test_a_plan_sees_the_times_of_the_file(walk: bytes, mannequin: bytes) -> None:
    """A second more than single precision tells apart: what a contact spans must not depend on how times were handed on."""
    text = rt.edit(walk, {"edit": {"loop": {"times": 8}}}, formats=["bvh"]).to_bytes("bvh").decode()
    rate = next(line for line in text.splitlines() if line.startswith("Frame Time"))
    file = rt.File("walk.bvh", text.replace(rate, "Frame Time: 0.0333333").encode())
    poses = rt.Poses.read(file)
    assert poses.frame_count > 900
    assert np.abs(poses.times - np.arange(poses.frame_count) * 0.0333333).max() < 1e-9
    wanted = rt.retarget(file, mannequin, {"report": "none"}, formats=["npz"]).poses.global_positions()
    assert np.abs(rt.Plan(file, mannequin).run(poses).global_positions() - wanted).max() < 1e-4


def test_an_archive_goes_out_and_in(walk: bytes, tmp_path: Path) -> None:
    poses = rt.Poses.read(walk)
    poses.to_npz(tmp_path / "walk.npz")
    back = rt.Poses.from_npz(tmp_path / "walk.npz")
    assert back.joint_names == poses.joint_names and (back.axes, back.unit) == (poses.axes, poses.unit)
    assert np.array_equal(back.rotations, poses.rotations) and back.to_bytes() == poses.to_bytes()
    with np.load(tmp_path / "walk.npz") as archive:
        assert np.array_equal(archive["translations"], poses.translations), "NumPy reads it too"
    assert rt.inspect(tmp_path / "walk.npz")["clips"][0]["frames"] == 121, "and so does the engine"


def test_positions_are_those_of_the_engine(walk: bytes) -> None:
    out = rt.edit(walk, {}, formats=["npz", "positions_csv"])
    table = out.to_bytes("positions_csv").decode().splitlines()
    head, first = table[0].split(","), table[1].split(",")
    poses = out.poses
    places = poses.global_positions()
    told = {name: float(value) for name, value in zip(head, first, strict=True) if name.endswith((".x", ".y", ".z", "_x", "_y", "_z"))}
    assert told, head[:6]
    for joint, name in enumerate(poses.joint_names):
        for axis, letter in enumerate("xyz"):
            key = next((f"{name}{mark}{letter}" for mark in "._" if f"{name}{mark}{letter}" in told), None)
            if key is not None:
                assert abs(told[key] - places[0, joint, axis]) < 1e-4, key


def test_poses_of_arrays_that_one_has(mannequin: bytes) -> None:
    names, parents = ["Hips", "Spine", "Head"], [-1, 0, 1]
    turned = np.zeros((4, 3, 4), np.float32)
    turned[..., 3] = 1
    poses = rt.Poses.of(names, parents, [[0, 1, 0], [0, 0.3, 0], [0, 0.3, 0]], turned, fps=10)
    assert np.allclose(poses.global_positions()[0, :, 1], [1, 1.3, 1.6]) and poses.fps == 10
    assert rt.inspect(poses)["clips"][0]["frames"] == 4
    assert len(poses.frames(1, 3)) == 2 and poses.joint("Head") == 2
    with pytest.raises(ValueError, match="rotations: the shape"):
        rt.Poses.of(names, parents, [[0, 0, 0]] * 3, turned[:, :2])
    with pytest.raises(KeyError):
        poses.joint("Tail")


def test_archives_with_objects_are_not_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "bad.npz", joint_names=np.array([{"a": 1}], dtype=object))
    with pytest.raises(ValueError, match="objects"):
        rt.Poses.from_npz(tmp_path / "bad.npz")


def test_a_plan_gives_what_a_retarget_gives(walk: bytes, mannequin: bytes) -> None:
    plan = rt.Plan(walk, mannequin)
    poses = rt.Poses.read(walk)
    wanted = rt.retarget(walk, mannequin).poses
    made = plan.run(poses)
    assert made.joint_names == wanted.joint_names and made.parents.tolist() == wanted.parents.tolist()
    for key in ("translations", "rotations", "scales"):
        assert np.abs(getattr(made, key) - getattr(wanted, key)).max() < 2e-5, key
    assert np.allclose(plan.target.rest_translations, wanted.rest_translations)
    assert plan.facts["driven_joints"] > 10 and "Plan" in repr(plan)
    assert plan.resolved_spec["version"] == 1


def test_a_plan_takes_joints_in_any_order(walk: bytes, mannequin: bytes) -> None:
    plan = rt.Plan(walk, mannequin)
    poses = rt.Poses.read(walk)
    order = np.random.default_rng(1).permutation(poses.joint_count)
    shuffled = rt.Poses(
        joint_names=tuple(poses.joint_names[place] for place in order),
        parents=poses.parents[order],
        rest_translations=poses.rest_translations[order],
        rest_rotations=poses.rest_rotations[order],
        rest_scales=poses.rest_scales[order],
        times=poses.times,
        translations=poses.translations[:, order],
        rotations=poses.rotations[:, order],
        scales=poses.scales[:, order],
    )
    assert np.array_equal(plan.run(shuffled).rotations, plan.run(poses).rotations)
    lacking = rt.Poses.of(["Hips"], [-1], [[0, 0, 0]], poses.rotations[:, :1])
    with pytest.raises(ValueError, match="lack joints"):
        plan.run(lacking)


def test_a_plan_takes_arrays_wherever_they_lie(walk: bytes, mannequin: bytes) -> None:
    plan = rt.Plan(walk, mannequin)
    poses = rt.Poses.read(walk)
    room = bytearray(poses.rotations.nbytes + 1)
    crooked = np.frombuffer(room, np.float32, poses.rotations.size, 1).reshape(poses.rotations.shape)
    crooked[:] = poses.rotations
    assert not crooked.flags.aligned
    wanted = plan.run(poses).rotations
    for rotations in (crooked, np.asfortranarray(poses.rotations), poses.rotations.astype(np.float64)):
        made = plan.run_arrays(poses.times, rotations, poses.translations, poses.scales)
        assert np.array_equal(made[1], wanted)


def test_a_plan_refuses_what_it_cannot_do(walk: bytes, mannequin: bytes) -> None:
    with pytest.raises(rt.ConfigError) as refused:
        rt.Plan(walk, mannequin, {"edit": {"fps": 10}})
    assert refused.value.pointer == "/edit"
    plan = rt.Plan(walk, mannequin)
    poses = rt.Poses.read(walk)
    with pytest.raises(ValueError, match="shape"):
        plan.run_arrays(poses.times, poses.rotations[:, :-1])
    with pytest.raises(ValueError, match="shape"):
        plan.run_arrays(poses.times[:-1], poses.rotations)
    with pytest.raises(rt.InputRefused):
        plan.run_arrays(poses.times[::-1], poses.rotations)
    with pytest.raises(rt.InputRefused):
        plan.run_arrays(poses.times, np.full_like(poses.rotations, np.nan))


def test_a_plan_for_a_source_without_a_clip(mannequin: bytes, walk: bytes) -> None:
    """A rig in its rest pose is enough."""
    plan = rt.Plan(mannequin, mannequin)
    still = plan.source
    frames = np.repeat(still.rest_rotations[None], 3, axis=0)
    made = plan.run_arrays([0, 0.1, 0.2], frames, np.repeat(still.rest_translations[None], 3, axis=0))
    assert np.abs(np.sum(made[1] * frames, axis=-1)).min() > 1 - 1e-5, "at rest, it stays at rest"


def test_ctrl_c_while_an_archive_is_written_is_heard(walk: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    poses = rt.Poses.read(walk)
    member = zipfile._ZipWriteFile  # type: ignore[attr-defined]
    close = member.close
    pressed = iter([True])

    def interrupted(self: object) -> None:
        if next(pressed, False):
            raise KeyboardInterrupt
        close(self)

    monkeypatch.setattr(member, "close", interrupted)
    with pytest.raises(KeyboardInterrupt):
        poses.to_bytes()
