"""python whole.py <REQUESTS

Reads whole files with Blender's importers. Each line of standard input asks for one, and each line of standard output answers
one, as tests/tools/three_reader/whole.mjs does, but for the names of clips. Nodes are objects and bones. Positions are +Y up, in meters (BVH: in the units of
the file); there are none at rest, since Blender's bones rest where they were bound.

A file that cannot be read has "error" instead. Needs the module bpy (from PyPI); without it the exit code is 2.
"""

import json
import sys

from blender import bpy, empty, load, set_frame, silent, to_y_up


def main():
    for line in sys.stdin:
        request = json.loads(line)
        with silent():
            try:
                answer = read(request["file"], request["clips"])
            except Exception as error:  # noqa: BLE001: whatever it is belongs into the answer
                answer = {"error": repr(error)}
        print(json.dumps({"file": request["file"]} | answer), flush=True)


def read(file, clips):
    empty()
    loaded = load(file)
    nodes = []
    for thing in bpy.data.objects:
        nodes.append((thing, None))
        if thing.type == "ARMATURE":
            nodes.extend((thing, bone) for bone in thing.pose.bones)
    index = {key(*node): number for number, node in enumerate(nodes)}

    def parent(thing, bone):
        if bone:
            return index[key(thing, bone.parent)]
        if not thing.parent:
            return None
        bone = thing.parent.pose.bones.get(thing.parent_bone) if thing.parent_type == "BONE" else None
        return index[key(thing.parent, bone)]

    names = [bone.name if bone else thing.name for thing, bone in nodes]
    answer = [{"name": name, "parent": parent(*node)} for name, node in zip(names, nodes)]
    seen = [sampled(loaded, nodes, clip["name"], clip["times"]) for clip in clips]
    return {"nodes": answer, "rest": [], "clips": seen}


def key(thing, bone):
    return (thing.name, bone.name if bone else None)


def sampled(loaded, nodes, name, times):
    actions = loaded.play(name)
    if not actions:
        return None
    first = min(action.frame_range[0] for action in actions)
    last = max(action.frame_range[1] for action in actions)
    positions = []
    for time in times:
        set_frame(loaded.frame(time))
        positions.append([place(*node) for node in nodes])
    return {"begin": loaded.seconds(first), "end": loaded.seconds(last), "positions": positions}


def place(thing, bone):
    world = thing.matrix_world @ bone.matrix if bone else thing.matrix_world
    return list(to_y_up(world.translation))


main()
