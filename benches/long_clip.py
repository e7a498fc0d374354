#!/usr/bin/env python3
"""Writes a walk of one hour: the sample walk's 65 joints, every one of them keyed at 60 frames per second.

    retargetd samples --output .
    python3 benches/long_clip.py walk.glb long_walk.glb
    /usr/bin/time -v retargetd retarget --source long_walk.glb --target mannequin.glb --output out.glb

The line "Maximum resident set size" is what a retarget of such a clip needs.
"""

import json
import struct
import sys

FRAMES = 60 * 60 * 60
FPS = 60


def main(source: str, output: str) -> None:
    document, binary = read(source)
    views, accessors = document["bufferViews"], document["accessors"]

    def values(index: int) -> bytes:
        accessor = accessors[index]
        size = 4 * {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        view = views[accessor["bufferView"]]
        first = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return binary[first : first + size * accessor["count"]]

    chunks, length = [binary], len(binary)

    def add(data: bytes, kind: str, **more: object) -> int:
        nonlocal length
        views.append({"buffer": 0, "byteOffset": length, "byteLength": len(data)})
        accessors.append({"bufferView": len(views) - 1, "componentType": 5126, "count": FRAMES, "type": kind, **more})
        chunks.append(data)
        length += len(data)
        return len(accessors) - 1

    times = struct.pack(f"<{FRAMES}f", *(frame / FPS for frame in range(FRAMES)))
    input_accessor = add(times, "SCALAR", min=[0.0], max=[(FRAMES - 1) / FPS])
    animation = document["animations"][0]
    samplers, channels = [], []
    keyed = set()

    def channel(node: int, path: str, data: bytes) -> None:
        kind, size = ("VEC4", 16) if path == "rotation" else ("VEC3", 12)
        data = (data * (FRAMES * size // len(data) + 1))[: FRAMES * size]
        samplers.append({"input": input_accessor, "output": add(data, kind), "interpolation": "LINEAR"})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})
        keyed.add((node, path))

    for old in animation["channels"]:
        target = old["target"]
        channel(target["node"], target["path"], values(animation["samplers"][old["sampler"]]["output"]))
    for node in document["skins"][0]["joints"]:
        if (node, "rotation") not in keyed:
            rest = document["nodes"][node].get("rotation", [0, 0, 0, 1])
            channel(node, "rotation", struct.pack("<4f", *rest) + struct.pack("<4f", *rest))
    animation["samplers"], animation["channels"] = samplers, channels
    document["buffers"][0]["byteLength"] = length
    write(output, document, chunks, length)


def read(path: str) -> tuple[dict, bytes]:
    with open(path, "rb") as file:
        data = file.read()
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def write(path: str, document: dict, chunks: list[bytes], length: int) -> None:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    padding = -length % 4
    total = 12 + 8 + len(text) + 8 + length + padding
    with open(path, "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, total))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", length + padding, b"BIN\0"))
        for chunk in chunks:
            file.write(chunk)
        file.write(b"\0" * padding)


if __name__ == "__main__":
    main(*sys.argv[1:])
