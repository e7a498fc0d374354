"""python read.py FILE...

Reads glTF, FBX and BVH files with Blender's importers and prints one JSON line for each, as tests/tools/three_reader does:
    {"file", "clip", "seconds", "times": [...], "joints": {"<name>": [[x, y, z, qx, qy, qz, qw], ... one per time]}}
with the world transforms of all bones at five times of the first clip, +Y up, in metres (BVH: in the units of the file).
Bones have Blender's own axes, so only how their rotations change says something.

A file that cannot be read has "error" instead. Needs the module bpy (from PyPI); without it the exit code is 2.
"""

import contextlib
import json
import math
import os
import sys

try:
    import bpy
    from mathutils import Quaternion
except ImportError as error:
    print(f"the module bpy is not there: pip install bpy ({error})", file=sys.stderr)
    sys.exit(2)

PARTS = (0.0, 0.25, 0.5, 0.75, 1.0)
# Blender's up is Z, and its front -Y.
UP = Quaternion((1, 0, 0), -math.pi / 2)


def main():
    for file in sys.argv[1:]:
        # Importers talk to standard output, which is the answer's.
        with silent():
            try:
                answer = read(file)
            except Exception as error:  # noqa: BLE001: whatever it is belongs into the answer
                answer = {"error": repr(error)}
        print(json.dumps({"file": file} | answer), flush=True)


def read(file):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    ending = file.rsplit(".", 1)[-1].lower()
    if ending == "bvh":
        bpy.ops.import_anim.bvh(filepath=file, update_scene_fps=True)
    elif ending == "fbx":
        bpy.ops.import_scene.fbx(filepath=file)
    else:
        bpy.ops.import_scene.gltf(filepath=file)
    scene = bpy.context.scene
    armatures = [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]
    action = next(thing.animation_data.action for thing in armatures if thing.animation_data)
    frames_per_second = scene.render.fps / scene.render.fps_base
    first, last = action.frame_range
    seconds = (last - first) / frames_per_second
    joints = {}
    for part in PARTS:
        frame = first + part * (last - first)
        scene.frame_set(math.floor(frame), subframe=frame - math.floor(frame))
        for armature in armatures:
            for bone in armature.pose.bones:
                world = armature.matrix_world @ bone.matrix
                position = UP @ world.translation
                rotation = UP @ world.to_quaternion()
                numbers = [*position, rotation.x, rotation.y, rotation.z, rotation.w]
                joints.setdefault(bone.name, []).append(numbers)
    times = [part * seconds for part in PARTS]
    return {"clip": action.name, "seconds": seconds, "times": times, "joints": joints}


@contextlib.contextmanager
def silent():
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)


main()
