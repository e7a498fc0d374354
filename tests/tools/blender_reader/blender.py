"""Blender without its window: what the scripts beside this one share."""

import contextlib
import math
import os
import sys

try:
    import bpy
    from mathutils import Quaternion
except ImportError as error:
    print(f"the module bpy is not there: pip install bpy ({error})", file=sys.stderr)
    sys.exit(2)

# Blender's up is Z, and its front -Y.
UP = Quaternion((1, 0, 0), -math.pi / 2)


class Loaded:
    """A file in the scene, and how its time is counted in frames."""

    def __init__(self, ending, first_frame):
        scene = bpy.context.scene
        self.frames_per_second = scene.render.fps / scene.render.fps_base
        self.ending, self.first_frame = ending, first_frame

    def frame(self, seconds):
        return self.first_frame + seconds * self.frames_per_second

    def seconds(self, frame):
        return (frame - self.first_frame) / self.frames_per_second

    def play(self, name):
        """Lets the clip of this name move everything that it moves, and nothing else anything; returns the actions."""
        playing = []
        for thing in bpy.data.objects:
            if not thing.animation_data:
                continue
            for track in thing.animation_data.nla_tracks:
                track.mute = True
            thing.animation_data.action = None
            for action in bpy.data.actions:
                if slot := self.slot(action, name, thing):
                    thing.animation_data.action = action
                    thing.animation_data.action_slot = slot
                    playing.append(action)
        return playing

    def slot(self, action, name, thing):
        """That of an action for an object, where it is of the clip."""
        slots = list(action.slots)
        if self.ending == "bvh":
            return slots[0]
        if self.ending == "gltf":
            own = [slot for slot in slots if slot.identifier == f"OB{thing.name}"]
            return own[0] if own and action.name == name else None
        # The names are object|stack|layer, or object|stack where the layer has no name of its own; any may have bars in it.
        own = f"{thing.name}|{name}"
        return slots[0] if slots and (action.name == own or action.name.startswith(f"{own}|")) else None


def empty():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def load(file):
    ending = file.rsplit(".", 1)[-1].lower()
    if ending == "bvh":
        bpy.ops.import_anim.bvh(filepath=file, update_scene_fps=True)
        return Loaded("bvh", 1)
    if ending == "fbx":
        bpy.ops.import_scene.fbx(filepath=file)
        return Loaded("fbx", 1)
    bpy.ops.import_scene.gltf(filepath=file)
    return Loaded("gltf", 0)


def set_frame(frame):
    bpy.context.scene.frame_set(math.floor(frame), subframe=frame - math.floor(frame))


def to_y_up(vector):
    return UP @ vector


@contextlib.contextmanager
def silent():
    """Importers talk to standard output, which is the answer's."""
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)
