# SPDX-License-Identifier: GPL-3.0-or-later
"""A retarget from sampled frames to new actions, step by step, so that Blender can draw in between."""

import os
import time

import bpy
import numpy as np

from . import actions, armatures, npz
from .service import Task

# As long as a step may take before Blender draws again.
STEP_SECONDS = 0.02


class Motion:
    """An action of an armature, sampled frame by frame."""

    def __init__(self, scene, source, action):
        self._scene, self._source, self._action = scene, source, action
        self.name = action.name if action else source.name

    def steps(self):
        """Samples; gives how far it is, and leaves the scene as it was."""
        scene, source = self._scene, self._source
        start, end = (int(np.floor(self._action.frame_range[0])), int(np.ceil(self._action.frame_range[1]))) if self._action else (scene.frame_start, scene.frame_end)
        frames = list(range(start, end + 1))
        bones = armatures.bones_of(source)
        room = np.empty(16 * len(source.pose.bones), np.float32)
        matrices = np.empty((len(frames), len(bones), 4, 4))
        before_frame, before_subframe = scene.frame_current, scene.frame_subframe
        data = source.animation_data
        before_action = data.action if data else None
        swaps = self._action is not None and self._action != before_action and data is not None
        before_slot = getattr(data, "action_slot", None) if data else None
        try:
            if swaps:
                actions.assign(source, self._action)
            begin = time.monotonic()
            for number, frame in enumerate(frames):
                scene.frame_set(frame)
                evaluated = source.evaluated_get(bpy.context.evaluated_depsgraph_get())
                matrices[number] = armatures.posed_matrices(evaluated, bones, room)
                if time.monotonic() - begin > STEP_SECONDS:
                    yield number / len(frames)
                    begin = time.monotonic()
        finally:
            if swaps:
                data.action = before_action
                if before_slot is not None:
                    data.action_slot = before_slot
            scene.frame_set(before_frame, subframe=before_subframe)
        times = (np.array(frames) - start) / actions.scene_rate(scene)
        self.first_frame = float(start)
        rig, name = armatures.Rig(source, scene.unit_settings.scale_length), self.name
        self.make_arrays = lambda: rig.arrays(matrices, times, name)


def posed_rest(scene, armature_object):
    """The armature with its pose as it is now for a rest pose."""
    bones = armatures.bones_of(armature_object)
    room = np.empty(16 * len(armature_object.pose.bones), np.float32)
    evaluated = armature_object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    pose = armatures.posed_matrices(evaluated, bones, room)
    rig = armatures.Rig(armature_object, scene.unit_settings.scale_length)
    return lambda: rig.arrays(rest=pose, name="rest")


def encoded(files):
    """Files as they are sent; arrays are made of what was sampled, and bytes of arrays. Nothing here asks Blender."""
    return [(part, name, data if isinstance(data, bytes) else npz.encode(data())) for part, name, data in files]


def config_of(settings):
    """The config that the panel says."""
    config = {"output": {"format": "poses_npz"}, "report": "summary"}
    if settings.preset == "plain_fk":
        config["ops"] = [{"op": "pelvis"}, {"op": "fk"}]
    if not settings.align:
        config["align"] = "off"
    roles = {}
    for row in settings.roles:
        if row.target != row.found:
            names = [name.strip() for name in row.target.split(",") if name.strip()]
            roles[row.name] = names
    if roles:
        config["target"] = {"roles": roles}
    return config


def source_files(scene, settings, motion):
    files = [("source", f"{motion.name}.npz", motion.make_arrays)]
    if settings.source_pose_is_rest:
        files.append(("source_rest", "rest.npz", posed_rest(scene, settings.source)))
    return files


def file_source(path):
    place = bpy.path.abspath(path)
    try:
        with open(place, "rb") as file:
            return [("source", os.path.basename(place), file.read())]
    except OSError as error:
        raise armatures.Unusable(f"'{place}' cannot be read: {error.strerror}") from None


def target_files(scene, settings, target):
    target_name = target.name
    rig = armatures.Rig(target, scene.unit_settings.scale_length)
    files = [("target", f"{target.name}.npz", lambda: rig.arrays(name=target_name))]
    if settings.target_pose_is_rest:
        files.append(("target_rest", "rest.npz", posed_rest(scene, target)))
    return files


class Made:
    """What came of one motion on one target."""

    def __init__(self, target, action, report, first_frame):
        self.target, self.action, self.report, self.first_frame = target, action, report, first_frame


def run(scene, settings, service):
    """Everything, as steps: each gives a text for the user. Ends with a list of `Made`. A problem is raised, and then nothing of that
    motion is in the file."""
    targets = [settings.target, *(row.target for row in settings.more_targets)]
    targets = [target for target in dict.fromkeys(targets) if target is not None]
    if not targets:
        raise armatures.Unusable("choose a target")
    config = config_of(settings)
    prepared = []
    if settings.source_kind == "FILE":
        prepared.append((os.path.splitext(os.path.basename(settings.source_path))[0], 1.0, file_source(settings.source_path)))
    else:
        source = settings.source
        if source is None:
            raise armatures.Unusable("choose a source")
        own = source.animation_data.action if source.animation_data else None
        chosen = [own, *(row.action for row in settings.more_actions)]
        for action in dict.fromkeys(action for action in chosen if action is not None) or [None]:
            motion = Motion(scene, source, action)
            for share in motion.steps():
                yield f"samples {motion.name}: {share:.0%}"
            prepared.append((motion.name, motion.first_frame, source_files(scene, settings, motion)))
    made = []
    for target in targets:
        onto = target_files(scene, settings, target)
        rig = armatures.Rig(target, scene.unit_settings.scale_length)
        for name, first_frame, files in prepared:
            sent = [*files, *onto]

            def ask(is_canceled, tell, sent=(*files, *onto), rig=rig):
                answer, report = service().retarget(encoded(sent), config, is_canceled, tell)
                return actions.Channels(rig, npz.decode(answer)), report

            task = Task(ask)
            try:
                while not task.is_done():
                    yield f"{name} onto {target.name}: {task.told or 'asks'}"
            finally:
                task.cancel()
            if task.error:
                raise armatures.Unusable(task.error)
            channels, report = task.result
            # The action is there whole, or not at all.
            writing = actions.new_action_steps(target, rig, channels, f"{name} on {target.name}", first_frame)
            action, begin = None, time.monotonic()
            while action is None:
                try:
                    next(writing)
                except StopIteration as end:
                    action = end.value
                if time.monotonic() - begin > STEP_SECONDS:
                    yield f"{name} onto {target.name}: writes"
                    begin = time.monotonic()
            if settings.assign:
                actions.assign(target, action)
            if settings.add_strip:
                actions.add_strip(target, action, first_frame)
            made.append(Made(target, action, report, first_frame))
            yield f"{name} onto {target.name}: done"
    return made


def findings_of(report, first_frame, scene_rate):
    """Measures that do not pass: verdict, text, scene frame and bone where each is worst."""
    measures = report.get("measures") or {}
    rows = []
    for name, metric in (measures.get("metrics") or {}).items():
        if metric.get("verdict") not in ("warn", "fail"):
            continue
        worst = next(iter(metric.get("worst") or []), {})
        frame = round(first_frame + worst.get("time_seconds", 0) * scene_rate)
        text = f"{name.replace('_', ' ')}: {metric.get('value', 0):.3g} {metric.get('unit', '')}"
        rows.append((metric["verdict"], text, frame, worst.get("joint", "")))
    return sorted(rows, key=lambda row: row[0] != "fail")
