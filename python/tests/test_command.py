"""The command that comes with the wheel, and that both give the same bytes."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import retargetd as rt

from conftest import LONG, SHARED, run



def test_the_command_is_the_whole_command_line(files: tuple[Path, Path], tmp_path: Path) -> None:
    assert run("--version").stdout.strip() == f"retargetd {rt.__version__}"
    out = tmp_path / "out.glb"
    ran = run("retarget", "--source", files[0], "--target", files[1], "--output", out, "--report", tmp_path / "r.html")
    assert ran.returncode == 0 and "verdict: " in ran.stderr, ran.stderr
    assert out.read_bytes() == rt.retarget(*files).data
    ran = run("retarget", "--source", tmp_path / "none.glb", "--target", files[1], "--output", out)
    assert ran.returncode == 3 and "hint:" in ran.stderr, ran.stderr
    assert run("nonsense").returncode == 2


def pairs(corpus: Path) -> list[tuple[Path, Path]]:
    """Files that move, each onto the next characters, by size: the small ones in continuous integration."""
    kinds = {".glb", ".fbx", ".bvh", ".vrm", ".vrma", ".npz", ".gltf"}
    found = [path for path in sorted(corpus.rglob("*")) if path.suffix in kinds and "hostile" not in path.parts]
    small = [path for path in found if path.stat().st_size < (6 << 20 if LONG else 2 << 20)]
    moving, bodies = [], []
    for path in small[:: max(1, len(small) // (60 if LONG else 14))]:
        try:
            held = rt.inspect(path)
        except rt.Error:
            continue
        is_body = any(rig["kind"] == "biped" for rig in held["rigs"])
        frames = max((clip["frames"] for clip in held["clips"]), default=0)
        if is_body and 1 < frames < (3000 if LONG else 300):
            moving.append(path)
        if is_body:
            bodies.append(path)
    wanted = 30 if LONG else 4
    return [(clip, bodies[(7 * number + 3) % len(bodies)]) for number, clip in enumerate(moving * 3)][:wanted]


def test_the_same_bytes_as_the_command_line_on_real_files(corpus: Path, tmp_path: Path) -> None:
    compared = 0
    for source, target in pairs(corpus):
        out, arrays = tmp_path / "out.glb", tmp_path / "out.npz"
        ran = run("retarget", "--source", source, "--target", target, "--output", out, "--output", arrays)
        try:
            here = rt.retarget(source, target, formats=["glb", "npz"])
        except rt.Error as error:
            assert ran.returncode != 0 and error.detail.split("\n")[0][:40] in ran.stderr, (source, target, ran.stderr)
            continue
        assert ran.returncode == 0, ran.stderr
        assert here.data == out.read_bytes(), (source.relative_to(SHARED), target.relative_to(SHARED))
        assert here.to_bytes("npz") == arrays.read_bytes()
        with np.load(io.BytesIO(arrays.read_bytes())) as archive:
            assert np.array_equal(archive["rotations"], here.poses.rotations)
            assert np.array_equal(archive["translations"], here.poses.translations)
        compared += 1
    print(f"{compared} pairs with the same bytes")
    assert compared >= (30 if LONG else 3)


@pytest.mark.long
def test_a_plan_is_what_a_retarget_is_on_real_files(corpus: Path) -> None:
    """Plain kinematics and the default stack, which looks at spans of time: times come through arrays as they are in the file."""
    plain, whole = [], []
    for source, target in pairs(corpus)[:20]:
        for apart, preset in ((plain, "plain_fk"), (whole, None)):
            try:
                made = rt.Plan(source, target, preset=preset).run(rt.Poses.read(source)).global_positions()
                wanted = rt.retarget(source, target, {"report": "none"}, preset=preset, formats=["npz"]).poses.global_positions()
            except rt.Error:
                continue
            apart.append(float(np.abs(made - wanted).max() / np.ptp(wanted[0], axis=0).max()))
    print(f"{len(plain)} pairs, plain: at most {max(plain):.1e} of the figure; {len(whole)}, default stack: at most {max(whole):.1e}")
    assert len(whole) >= 15
    assert max(plain) < 1e-5 and max(whole) < 1e-4
