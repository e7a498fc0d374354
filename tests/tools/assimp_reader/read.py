"""python read.py FILE...

Reads files with assimp's importers and prints one JSON line for each, as tests/tools/three_reader does:
    {"file", "clip", "seconds", "times": [...], "joints": {"<name>": [[x, y, z, qx, qy, qz, qw], ... one per time]}}
with the world transforms of all named nodes at five times of the first clip, as assimp's scene in memory has them: without any of
its post-processing, and without its exporters.

A file that cannot be read has "error" instead. Needs PyPI's pyassimp and the library that it binds (Debian's assimp-utils); without
them the exit code is 2.
"""

import ctypes
import json
import sys

try:
    import numpy
    from pyassimp import core, structs
except Exception as error:  # noqa: BLE001: pyassimp has errors of its own for a library that is not there
    print(f"pyassimp is not there: pip install pyassimp numpy, apt-get install assimp-utils ({error})", file=sys.stderr)
    sys.exit(2)

PARTS = (0.0, 0.25, 0.5, 0.75, 1.0)
# What a file that says no rate has: assimp's own viewers take it.
TICKS_PER_SECOND = 25.0


def main():
    for file in sys.argv[1:]:
        try:
            answer = read(file)
        except Exception as error:  # noqa: BLE001: whatever it is belongs into the answer
            answer = {"error": repr(error)}
        print(json.dumps({"file": file} | answer), flush=True)


def read(file):
    library = core._assimp_lib.dll
    library.aiCreatePropertyStore.restype = ctypes.c_void_p
    library.aiImportFileExWithProperties.restype = ctypes.POINTER(structs.Scene)
    store = ctypes.c_void_p(library.aiCreatePropertyStore())
    # Else it hangs a chain of nodes for FBX's pivots and pre-rotations above each node and animates the node by all of it once more:
    # Mixamo's and Maya's own files come out in pieces.
    library.aiSetImportPropertyInteger(store, b"IMPORT_FBX_PRESERVE_PIVOTS", 0)
    loaded = library.aiImportFileExWithProperties(file.encode(), 0, None, store)
    if not loaded:
        raise ValueError("assimp cannot read it")
    return sampled(loaded.contents)


def sampled(scene):
    if not scene.mNumAnimations:
        raise ValueError("assimp sees no animation")
    clip = scene.mAnimations[0].contents
    rate = clip.mTicksPerSecond or TICKS_PER_SECOND
    channels = [clip.mChannels[index].contents for index in range(clip.mNumChannels)]
    channels = {text(channel.mNodeName): channel for channel in channels}
    joints = {}
    for part in PARTS:
        seen = set()
        open_nodes = [(scene.mRootNode.contents, numpy.eye(4))]
        while open_nodes:
            node, above = open_nodes.pop()
            name = text(node.mName)
            world = above @ local(node, channels.get(name), part * clip.mDuration)
            if name and name not in seen:
                seen.add(name)
                joints.setdefault(name, []).append([*world[:3, 3], *rotation(world)])
            open_nodes.extend((node.mChildren[index].contents, world) for index in range(node.mNumChildren))
    seconds = clip.mDuration / rate
    return {"clip": text(clip.mName), "seconds": seconds, "times": [part * seconds for part in PARTS], "joints": joints}


def text(string):
    return string.data.decode("utf8", "replace")


def local(node, channel, time):
    if channel is None:
        matrix = node.mTransformation
        rows = [[getattr(matrix, f"{row}{column}") for column in range(1, 5)] for row in "abcd"]
        return numpy.array(rows)
    vector = lambda key: numpy.array([key.mValue.x, key.mValue.y, key.mValue.z])  # noqa: E731
    quaternion = lambda key: numpy.array([key.mValue.x, key.mValue.y, key.mValue.z, key.mValue.w])  # noqa: E731
    place = between(channel.mPositionKeys, channel.mNumPositionKeys, time, vector)
    turn = between(channel.mRotationKeys, channel.mNumRotationKeys, time, quaternion)
    scale = between(channel.mScalingKeys, channel.mNumScalingKeys, time, vector)
    matrix = numpy.eye(4)
    matrix[:3, :3] = matrix_of(turn / numpy.linalg.norm(turn)) * scale
    matrix[:3, 3] = place
    return matrix


def between(keys, count, time, value_of):
    after = next((index for index in range(count) if keys[index].mTime >= time), count - 1)
    value = value_of(keys[after])
    if after == 0 or keys[after].mTime <= time:
        return value
    before = value_of(keys[after - 1])
    part = (time - keys[after - 1].mTime) / (keys[after].mTime - keys[after - 1].mTime)
    if len(value) == 4 and numpy.dot(before, value) < 0:
        value = -value
    return before + (value - before) * part


def matrix_of(quaternion):
    x, y, z, w = quaternion
    return numpy.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation(world):
    axes = world[:3, :3] / numpy.linalg.norm(world[:3, :3], axis=0)
    # The eigenvector of the symmetric matrix whose largest eigenvalue belongs to the quaternion, exact for any angle.
    (a, b, c), (d, e, f), (g, h, i) = axes
    symmetric = numpy.array(
        [
            [a - e - i, d + b, g + c, h - f],
            [d + b, e - a - i, h + f, c - g],
            [g + c, h + f, i - a - e, d - b],
            [h - f, c - g, d - b, a + e + i],
        ]
    )
    _, vectors = numpy.linalg.eigh(symmetric)
    return [float(component) for component in vectors[:, -1]]


main()
