# SPDX-License-Identifier: GPL-3.0-or-later
"""Armatures to pose arrays and back. Nothing here draws, asks or waits.

Arrays are in the space of the world: the object's own rotation and scale are in the roots. Blender's world is +Z up with figures that look
along -Y, and its unit is that of the scene.
"""

import numpy as np

AXES = "+z-y"
# Object modes of a bone's rotation, and how many numbers each has.
CHANNELS = {"QUATERNION": ("rotation_quaternion", 4), "AXIS_ANGLE": ("rotation_axis_angle", 4)}
EULER = ("rotation_euler", 3)


class Unusable(Exception):
    """An armature cannot be used; the text says why, and what to do."""


def bones_of(armature_object):
    """Bones, parents before children."""
    bones = armature_object.data.bones
    if len(bones) == 0:
        raise Unusable(f"'{armature_object.name}' has no bones")
    order, waiting = [], [bone for bone in bones if bone.parent is None][::-1]
    while waiting:
        bone = waiting.pop()
        order.append(bone)
        waiting.extend(reversed(bone.children))
    return order


def parents_of(bones):
    places = {bone.name: place for place, bone in enumerate(bones)}
    return np.array([places[bone.parent.name] if bone.parent else -1 for bone in bones], np.int32)


def rest_matrices(bones):
    """Bones at rest, in the space of the object."""
    return np.array([bone.matrix_local for bone in bones], np.float64)


def posed_matrices(evaluated_object, bones, room):
    """Bones as they are posed, in the space of the object; `room` has 16 numbers for each of the pose's bones."""
    pose_bones = evaluated_object.pose.bones
    pose_bones.foreach_get("matrix", room)
    # Blender gives matrices column by column.
    matrices = room.reshape(-1, 4, 4).transpose(0, 2, 1)
    return matrices[[pose_bones.find(bone.name) for bone in bones]]


def world_of(matrix_world, scene_unit):
    """The object's rotation, its place and its scale, in scene units."""
    matrix = np.array(matrix_world, np.float64)
    scales = np.linalg.norm(matrix[:3, :3], axis=0)
    if scales.min() <= 1e-9 or scales.max() / scales.min() > 1.001:
        raise Unusable(f"the object is scaled by {np.round(scales, 4).tolist()}: apply the scale where it differs by axis")
    if np.linalg.det(matrix[:3, :3]) < 0:
        raise Unusable("the object is mirrored by its scale: apply the scale")
    return matrix[:3, :3] / scales.mean(), matrix[:3, 3], float(scales.mean())


def local_of(matrices, parents, world):
    """Local translations, rotations (x y z w) and scales of matrices (..., J, 4, 4) in the space of the object."""
    turn, place, size = world
    above = np.broadcast_to(np.eye(4), matrices.shape).copy()
    has_parent = parents >= 0
    above[..., has_parent, :, :] = matrices[..., parents[has_parent], :, :]
    local = np.linalg.inv(above) @ matrices
    translations = local[..., :3, 3] * size
    linear = local[..., :3, :3]
    scales = np.linalg.norm(linear, axis=-2)
    rotations = linear / np.maximum(scales, 1e-12)[..., None, :]
    roots = ~has_parent
    translations[..., roots, :] = translations[..., roots, :] @ turn.T + place
    rotations[..., roots, :, :] = turn @ rotations[..., roots, :, :]
    return translations.astype(np.float32), quaternions_of(rotations).astype(np.float32), scales.astype(np.float32)


def matrices_of(translations, rotations, scales, parents, world):
    """The way back: matrices (F, J, 4, 4) in the space of the object."""
    turn, place, size = world
    frames, joints = rotations.shape[:2]
    local = np.zeros((frames, joints, 4, 4))
    local[..., 3, 3] = 1
    linear = rotation_matrices(rotations)
    moved = np.asarray(translations, np.float64).copy()
    roots = parents < 0
    linear[:, roots] = turn.T @ linear[:, roots]
    moved[:, roots] = (moved[:, roots] - place) @ turn
    local[..., :3, :3] = linear * np.asarray(scales, np.float64)[..., None, :]
    local[..., :3, 3] = moved / size
    model = np.empty_like(local)
    for joint, parent in enumerate(parents):
        model[:, joint] = local[:, joint] if parent < 0 else model[:, parent] @ local[:, joint]
    return local, model


class Rig:
    """What there is to know of an armature at rest, as plain numbers: threads may work with it while Blender draws."""

    def __init__(self, armature_object, scene_unit):
        bones = bones_of(armature_object)
        self.object_name = armature_object.name
        self.names = [bone.name for bone in bones]
        self.parents = parents_of(bones)
        self.rest = rest_matrices(bones)
        self.unit = scene_unit
        self.world = world_of(armature_object.matrix_world, scene_unit)

    def arrays(self, matrices=None, times=(), name="", rest=None):
        """Pose arrays as the service takes them. `matrices` (F, J, 4, 4) are poses; `rest` is another rest pose (J, 4, 4)."""
        at_rest = local_of(self.rest if rest is None else rest, self.parents, self.world)
        if matrices is None or len(matrices) == 0:
            moved = [np.zeros((0, *part.shape), np.float32) for part in at_rest]
        else:
            moved = local_of(matrices, self.parents, self.world)
        return {
            "joint_names": np.array(self.names),
            "parents": self.parents,
            "rest_translations": at_rest[0],
            "rest_rotations": at_rest[1],
            "rest_scales": at_rest[2],
            "times": np.asarray(times, np.float64),
            "translations": moved[0],
            "rotations": moved[1],
            "scales": moved[2],
            "meta": {"name": name, "axes": AXES, "unit": self.unit},
        }

    def basis(self, arrays):
        """What the bones' channels are for a motion: matrices (F, J, 4, 4) relative to each bone's rest, and the same in the space of the
        object."""
        by_name = {name: place for place, name in enumerate(arrays["joint_names"].tolist())}
        missing = [name for name in self.names if name not in by_name]
        if missing:
            raise Unusable(f"the result lacks bones of '{self.object_name}': {', '.join(missing[:5])}")
        order = [by_name[name] for name in self.names]
        moved = (arrays[key][:, order] for key in ("translations", "rotations", "scales"))
        local, model = matrices_of(*moved, self.parents, self.world)
        above = np.where((self.parents >= 0)[:, None, None], self.rest[np.maximum(self.parents, 0)], np.eye(4))
        rest_local = np.linalg.inv(above) @ self.rest
        return np.linalg.inv(rest_local) @ local, model


def arrays_of(armature_object, scene_unit, matrices=None, times=(), name="", rest=None):
    """The same of an armature."""
    return Rig(armature_object, scene_unit).arrays(matrices, times, name, rest)


def mend_basis(armature_object, rig, basis, model):
    """Puts right the bones that take less from their parents than is usual: what they take is Blender's to say."""
    bones = bones_of(armature_object)
    for place, bone in enumerate(bones):
        is_usual = bone.use_inherit_rotation and bone.inherit_scale == "FULL" and bone.use_local_location
        if bone.parent is None or is_usual:
            continue
        basis[:, place] = _unusual_basis(bone, model[:, place], model[:, rig.parents[place]])
    return bones


def _unusual_basis(bone, own, parent):
    from mathutils import Matrix

    rest, above = bone.matrix_local, bone.parent.matrix_local
    made = [
        bone.convert_local_to_pose(
            Matrix(pose.tolist()), rest, parent_matrix=Matrix(up.tolist()), parent_matrix_local=above, invert=True
        )
        for pose, up in zip(own, parent)
    ]
    return np.array(made, np.float64)


def quaternions_of(matrices):
    """Unit quaternions x y z w of rotation matrices (..., 3, 3), by the largest component."""
    m = np.asarray(matrices, np.float64)
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    squares = np.stack([1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz], axis=-1)
    a, b, c = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    d, e, f = m[..., 0, 1] + m[..., 1, 0], m[..., 0, 2] + m[..., 2, 0], m[..., 1, 2] + m[..., 2, 1]
    rows = np.stack(
        [
            np.stack([squares[..., 0], d, e, a], axis=-1),
            np.stack([d, squares[..., 1], f, b], axis=-1),
            np.stack([e, f, squares[..., 2], c], axis=-1),
            np.stack([a, b, c, squares[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    largest = squares.argmax(axis=-1)
    chosen = np.take_along_axis(rows, largest[..., None, None], axis=-2)[..., 0, :]
    return chosen / np.linalg.norm(chosen, axis=-1, keepdims=True)


def rotation_matrices(quaternions):
    x, y, z, w = np.moveaxis(np.asarray(quaternions, np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
