# SPDX-License-Identifier: GPL-3.0-or-later
"""One new action of a motion, in the ways in which Blender has kept them over the years."""

import bpy
import numpy as np

from .armatures import CHANNELS, EULER, Rig, mend_basis, quaternions_of

LINEAR = 1


def new_action(armature_object, arrays, name, first_frame=1.0, fps=None):
    """Makes an action of a result for an armature. Nothing else of the file is touched: it is in nobody's use yet."""
    rig = Rig(armature_object, bpy.context.scene.unit_settings.scale_length)
    steps = new_action_steps(armature_object, rig, Channels(rig, arrays), name, first_frame, fps)
    try:
        while True:
            next(steps)
    except StopIteration as end:
        return end.value


class Channels:
    """What bones do in a motion; made without Blender, so that a thread can do it."""

    def __init__(self, rig, arrays):
        self.times = np.asarray(arrays["times"], np.float64)
        self.basis, self.model = rig.basis(arrays)


def new_action_steps(armature_object, rig, channels, name, first_frame=1.0, fps=None):
    """The same bone by bone, so that Blender can draw in between. Ended before its end, it leaves no action."""
    scene_fps = fps or scene_rate(bpy.context.scene)
    basis = channels.basis
    bones = mend_basis(armature_object, rig, basis, channels.model)
    yield
    frames = (first_frame + channels.times * scene_fps).astype(np.float32)
    action = bpy.data.actions.new(name)
    is_whole = False
    try:
        action.use_fake_user = True
        curves = _curves_of(action, armature_object)
        locations = basis[..., :3, 3]
        for place, bone in enumerate(bones):
            linear = basis[:, place, :3, :3]
            scales = np.linalg.norm(linear, axis=-2)
            rotations = linear / np.maximum(scales, 1e-12)[:, None, :]
            path = f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].'
            channel, values = _rotation_values(armature_object.pose.bones[bone.name], quaternions_of(rotations))
            _write(curves, path + channel, values, frames, bone.name)
            if not bone.use_connect and np.abs(locations[:, place]).max(initial=0) > 1e-7:
                _write(curves, path + "location", locations[:, place], frames, bone.name)
            if np.abs(scales - 1).max(initial=0) > 1e-5:
                _write(curves, path + "scale", scales, frames, bone.name)
            yield
        is_whole = True
    finally:
        if not is_whole:
            bpy.data.actions.remove(action)
    return action


def assign(armature_object, action):
    """Has an armature play an action."""
    data = armature_object.animation_data or armature_object.animation_data_create()
    data.action = action
    if hasattr(data, "action_slot") and action.slots and data.action_slot is None:
        data.action_slot = action.slots[0]


def add_strip(armature_object, action, first_frame):
    """Puts an action into a track of its own of the armature."""
    data = armature_object.animation_data or armature_object.animation_data_create()
    track = data.nla_tracks.new()
    track.name = action.name
    strip = track.strips.new(action.name, int(first_frame), action)
    if hasattr(strip, "action_slot") and action.slots and strip.action_slot is None:
        strip.action_slot = action.slots[0]
    return strip


def scene_rate(scene):
    return scene.render.fps / scene.render.fps_base


class _Curves:
    """Where curves are made: in the action itself, or in the channels of its slot."""

    def __init__(self, make, groups):
        self._make = make
        self._groups = groups
        self._known = {}

    def new(self, path, index, group):
        if group not in self._known:
            self._known[group] = self._groups.new(group)
        curve = self._make(path, index)
        curve.group = self._known[group]
        return curve


def _curves_of(action, armature_object):
    if not hasattr(action, "slots"):
        return _Curves(lambda path, index: action.fcurves.new(path, index=index), action.groups)
    slot = action.slots.new(id_type="OBJECT", name=armature_object.name)
    layer = action.layers[0] if action.layers else action.layers.new("Layer")
    strip = layer.strips[0] if layer.strips else layer.strips.new(type="KEYFRAME")
    bag = strip.channelbag(slot, ensure=True)
    return _Curves(lambda path, index: bag.fcurves.new(path, index=index), bag.groups)


def _rotation_values(pose_bone, quaternions):
    """The channel of a bone's own rotation mode, and its values; the mode stays."""
    mode = pose_bone.rotation_mode
    wxyz = quaternions[:, [3, 0, 1, 2]].copy()
    # The shorter way from key to key: a sign for each, which is turned over where two neighbors lie apart.
    turns = np.where(np.sum(wxyz[1:] * wxyz[:-1], axis=-1) < 0, -1.0, 1.0)
    wxyz[1:] *= np.cumprod(turns)[:, None]
    if mode == "QUATERNION":
        return CHANNELS[mode][0], wxyz
    from mathutils import Quaternion

    if mode == "AXIS_ANGLE":
        values = []
        for quaternion in wxyz:
            axis, angle = Quaternion(quaternion.tolist()).to_axis_angle()
            values.append((angle, *axis))
        return CHANNELS[mode][0], np.array(values)
    values, before = [], None
    for quaternion in wxyz:
        rotation = Quaternion(quaternion.tolist())
        before = rotation.to_euler(mode, before) if before else rotation.to_euler(mode)
        values.append(tuple(before))
    return EULER[0], np.array(values)


def _write(curves, path, values, frames, group):
    for index in range(values.shape[1]):
        curve = curves.new(path, index, group)
        points = curve.keyframe_points
        points.add(len(frames))
        co = np.empty(2 * len(frames), np.float32)
        co[0::2], co[1::2] = frames, values[:, index]
        points.foreach_set("co", co)
        points.foreach_set("interpolation", np.full(len(frames), LINEAR, np.int32))
        curve.update()


def curves_of(action):
    """All curves of an action, wherever this Blender keeps them."""
    if hasattr(action, "slots"):
        for layer in action.layers:
            for strip in layer.strips:
                for bag in strip.channelbags:
                    yield from bag.fcurves
        return
    yield from action.fcurves


def moves(action, bone_names):
    """Whether it moves one of these bones."""
    quoted = (curve.data_path.split('"') for curve in curves_of(action) if curve.data_path.startswith("pose.bones["))
    return any(len(parts) > 1 and parts[1] in bone_names for parts in quoted)
