"""The engine in process: what it gives, in what forms it takes files, what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import retargetd as rt


def test_files_bytes_and_poses_are_the_same_to_it(files: tuple[Path, Path], walk: bytes, mannequin: bytes) -> None:
    by_path = rt.retarget(*files)
    by_text = rt.retarget(str(files[0]), str(files[1]))
    by_bytes = rt.retarget(bytearray(walk), memoryview(mannequin))
    assert by_path.data == by_text.data == by_bytes.data
    by_poses = rt.retarget(rt.Poses.read(walk), mannequin)
    assert by_poses.poses.frame_count == 121
    assert np.abs(by_poses.poses.rotations - by_path.poses.rotations).max() < 1e-4


def test_a_result_is_written_whole_in_any_format(files: tuple[Path, Path], tmp_path: Path) -> None:
    out = rt.retarget(*files, {"edit": {"fps": 30}})
    for ending in ("glb", "bvh", "npz", "json", "fbx", "gltf"):
        out.write(tmp_path / f"out.{ending}")
        assert rt.inspect(tmp_path / f"out.{ending}")["counts"]["joints"] > 10, ending
    out.write_report(tmp_path / "report.json")
    assert json.loads((tmp_path / "report.json").read_text())["resolved_spec"]["version"] == 1
    assert not [path for path in tmp_path.iterdir() if path.suffix == ".part"]
    with pytest.raises(ValueError, match="no format"):
        out.write(tmp_path / "out.xyz")
    assert not (tmp_path / "out.xyz").exists()


def test_the_resolved_spec_gives_the_same_again(walk: bytes, mannequin: bytes) -> None:
    out = rt.retarget(walk, mannequin)
    again = rt.retarget(walk, mannequin, out.resolved_spec)
    assert np.array_equal(again.poses.rotations, out.poses.rotations)
    assert np.array_equal(again.poses.translations, out.poses.translations)


def test_measures_are_a_table(walk: bytes, mannequin: bytes) -> None:
    measures = rt.retarget(walk, mannequin).measures
    by_name = {measure.name: measure for measure in measures}
    assert by_name["foot_slide"].unit and by_name["foot_slide"].verdict in ("pass", "warn")
    assert "<td>foot_slide</td>" in measures._repr_html_()


def test_curves_are_plotted(walk: bytes, mannequin: bytes) -> None:
    class Axes:
        drawn: list[str] = []

        def plot(self, times: list[float], values: list[float], label: str) -> None:
            assert len(times) == len(values) > 10
            self.drawn.append(label)

        def set_xlabel(self, _: str) -> None: ...
        def set_ylabel(self, _: str) -> None: ...
        def legend(self) -> None: ...

    out = rt.retarget(walk, mannequin)
    assert out.plot(axes=Axes()).drawn
    with pytest.raises(ValueError, match="slide_speed"):
        out.plot("none")


def test_a_notebook_shows_a_result(walk: bytes, mannequin: bytes) -> None:
    bundle = rt.retarget(walk, mannequin)._repr_mimebundle_()
    assert "data:image/webp;base64," in bundle["text/html"]
    assert "verdict " in bundle["text/plain"]


def test_pictures(walk: bytes, mannequin: bytes, tmp_path: Path) -> None:
    picture = rt.preview(walk, tmp_path / "walk.gif", size=64, fps=5)
    assert picture[:3] == b"GIF" and (tmp_path / "walk.gif").read_bytes() == picture
    assert rt.preview(mannequin, ending="png", size=[64, 32])[:4] == b"\x89PNG"
    both = rt.compare(walk, rt.retarget(walk, mannequin), ending="png", size=64, at_seconds=1.0)
    assert both[:4] == b"\x89PNG"
    with pytest.raises(rt.ConfigError) as refused:
        rt.preview(walk, ending="png", size=4)
    assert refused.value.code == "invalid_value"


def test_a_pose_and_an_edit(walk: bytes, mannequin: bytes) -> None:
    for to in ("t", "a", "rest", rt.File("walk.glb", walk)):
        assert rt.pose(mannequin, to).poses.frame_count == 1
    edited = rt.edit(walk, {"edit": {"reverse": True, "range": [0, 2]}}, formats="npz")
    assert edited.outputs[0].format == "poses_npz" and edited.poses.frame_count == 61


def test_a_config_says_what_the_task_is_as_on_the_command_line(walk: bytes, mannequin: bytes) -> None:
    posed = rt.retarget(walk, mannequin, {"pose": {"to": "t"}})
    assert posed.report["counts"]["frames"] == 1


def test_suggestions_explanations_and_tuning(walk: bytes, mannequin: bytes) -> None:
    suggested = rt.suggest(walk, mannequin)
    assert {role["role"] for role in suggested["roles"]} >= {"pelvis", "left_forearm"}
    by_suggestion = rt.retarget(walk, mannequin, suggested["resolved_spec"])
    assert np.array_equal(by_suggestion.poses.rotations, rt.retarget(walk, mannequin).poses.rotations)
    assert rt.explain(walk, mannequin, 10, "pelvis")["frame"] == 10
    tuned = rt.tune(walk, mannequin, max_evaluations=3)
    assert tuned.report["tuning"]["evaluations"] <= 3
    assert "tune" not in tuned.resolved_spec or tuned.resolved_spec["tune"] in (None, False)


def test_what_is_known_without_files() -> None:
    assert "mixamo" in rt.rigs()
    assert rt.schema()["type"] == "object" and rt.schema("rig")["type"] == "object"
    assert rt.__version__ == rt.version()
    assert rt.retarget(*rt.samples(), preset="plain_fk").resolved_spec["ops"][0]["op"] == "pelvis"
    with pytest.raises(ValueError, match="no preset"):
        rt.retarget(*rt.samples(), preset="none")


@pytest.mark.parametrize(
    ("config", "pointer", "code"),
    [
        ({"algin": "off"}, "/algin", "unknown_field"),
        ({"edit": {"fps": -1}}, "/edit/fps", "invalid_value"),
        ({"source": {"root": "Nobody"}}, "/source/root", "unknown_joint"),
    ],
)
def test_a_config_that_cannot_be_used(
    walk: bytes, mannequin: bytes, config: dict[str, object], pointer: str, code: str
) -> None:
    for isolate in (False, True):
        with pytest.raises(rt.ConfigError) as refused:
            rt.retarget(walk, mannequin, config, isolate=isolate)
        error = refused.value
        assert (error.pointer, error.code, error.part) == (pointer, code, "config"), error
        assert error.hint, "it says what to do"


def test_files_that_cannot_be_used(tmp_path: Path, walk: bytes, mannequin: bytes) -> None:
    with pytest.raises(FileNotFoundError):
        rt.inspect(tmp_path / "nothing.glb")
    with pytest.raises(IsADirectoryError):
        rt.inspect(tmp_path)
    with pytest.raises(rt.InputRefused) as refused:
        rt.retarget(walk[: len(walk) // 2], mannequin)
    assert (refused.value.code, refused.value.part) == ("asset_malformed", "source")
    with pytest.raises(TypeError, match="source"):
        rt.inspect(3)  # type: ignore[arg-type]
    with pytest.raises(rt.InputRefused) as refused:
        rt.retarget(mannequin, walk)
    assert refused.value.code == "no_animation"


def test_strict_refuses_what_warns(walk: bytes, mannequin: bytes) -> None:
    with pytest.raises(rt.InputRefused) as refused:
        thresholds = {"jerk_ratio": {"warn_above": 0.1, "fail_above": 0.2}}
        rt.retarget(walk, mannequin, {"strict": True, "report": {"thresholds": thresholds}})
    assert refused.value.code in ("strict_warnings", "strict_measures")


def test_gltf_with_files_beside_it(tmp_path: Path, walk: bytes, mannequin: bytes) -> None:
    """As the command line reads it."""
    length = int.from_bytes(walk[12:16], "little")
    document = json.loads(walk[20 : 20 + length])
    (tmp_path / "walk.bin").write_bytes(walk[20 + length + 8 :])
    document["buffers"][0]["uri"] = "walk.bin"
    (tmp_path / "walk.gltf").write_text(json.dumps(document))
    out = rt.retarget(tmp_path / "walk.gltf", mannequin)
    assert np.array_equal(out.poses.rotations, rt.retarget(walk, mannequin).poses.rotations)


def test_errors_travel_between_processes(walk: bytes) -> None:
    import pickle

    with pytest.raises(rt.ConfigError) as refused:
        rt.check_config({"algin": "off"})
    copy = pickle.loads(pickle.dumps(refused.value))
    assert isinstance(copy, rt.ConfigError)
    assert (copy.pointer, copy.errors, str(copy)) == (refused.value.pointer, refused.value.errors, str(refused.value))
