"""python read.py FILE...

Reads glTF, FBX and BVH files with Blender's importers and prints one JSON line for each, as tests/tools/three_reader does:
    {"file", "clip", "seconds", "times": [...], "joints": {"<name>": [[x, y, z, qx, qy, qz, qw], ... one per time]}}
with the world transforms of all bones at five times of the first clip, +Y up, in meters (BVH: in the units of the file); of all objects
where a file has no skeleton, as VRM animations have none.
Bones have Blender's own axes, so only how their rotations change says something.

A file that cannot be read has "error" instead. Needs the module bpy (from PyPI); without it the exit code is 2.
"""

import json
import sys

from blender import UP, bpy, empty, load, set_frame, silent, to_y_up

PARTS = (0.0, 0.25, 0.5, 0.75, 1.0)

def main():
    for file in sys.argv[1:]:
        with silent():
            try:
                answer = read(file)
            except Exception as error:  # noqa: BLE001: whatever it is belongs into the answer
                answer = {"error": repr(error)}
        print(json.dumps({"file": file} | answer), flush=True)


def read(file):
    empty()
    loaded = load(file)
    armatures = [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]
    action = next(thing.animation_data.action for thing in armatures or bpy.data.objects if thing.animation_data)
    first, last = action.frame_range
    seconds = (last - first) / loaded.frames_per_second
    joints = {}
    for part in PARTS:
        frame = first + part * (last - first)
        set_frame(frame)
        for name, world in worlds(armatures):
            position = to_y_up(world.translation)
            rotation = UP @ world.to_quaternion()
            numbers = [*position, rotation.x, rotation.y, rotation.z, rotation.w]
            joints.setdefault(name, []).append(numbers)
    times = [part * seconds for part in PARTS]
    return {"clip": action.name, "seconds": seconds, "times": times, "joints": joints}


def worlds(armatures):
    for armature in armatures:
        for bone in armature.pose.bones:
            yield bone.name, armature.matrix_world @ bone.matrix
    if not armatures:
        yield from ((thing.name, thing.matrix_world) for thing in bpy.data.objects)


main()
