#!/usr/bin/env python3
"""Writes a walk of one hour, or of as many as are asked for: the sample walk's 65 joints, every one of them keyed at 60 frames per second.

    retargetd samples --output .
    python3 benches/long_clip.py walk.glb long_walk.glb 10
    /usr/bin/time -v retargetd retarget --source long_walk.glb --target mannequin.glb --output out.glb

The line "Maximum resident set size" is what a retarget of such a clip needs.
"""

import json
import struct
import sys

FPS = 60
FRAMES_OF_HOUR = 60 * 60 * FPS


def main(source: str, output: str, hours: str = "1") -> None:
    frame_count = round(float(hours) * FRAMES_OF_HOUR)
    document, binary = read(source)
    views, accessors = document["bufferViews"], document["accessors"]

    def values(index: int) -> bytes:
        accessor = accessors[index]
        size = 4 * {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        view = views[accessor["bufferView"]]
        first = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return binary[first : first + size * accessor["count"]]

    # What is written, as values that are repeated up to a number of bytes: ten hours do not fit into memory.
    chunks, length = [(binary, len(binary))], len(binary)

    def add(data: bytes, size: int, kind: str, **more: object) -> int:
        nonlocal length
        views.append({"buffer": 0, "byteOffset": length, "byteLength": size})
        accessor = {"bufferView": len(views) - 1, "componentType": 5126, "count": frame_count, "type": kind, **more}
        accessors.append(accessor)
        chunks.append((data, size))
        length += size
        return len(accessors) - 1

    times = struct.pack(f"<{frame_count}f", *(frame / FPS for frame in range(frame_count)))
    input_accessor = add(times, len(times), "SCALAR", min=[0.0], max=[(frame_count - 1) / FPS])
    animation = document["animations"][0]
    samplers, channels = [], []
    keyed = set()

    def channel(node: int, path: str, data: bytes) -> None:
        kind, size = ("VEC4", 16) if path == "rotation" else ("VEC3", 12)
        output_accessor = add(data, frame_count * size, kind)
        samplers.append({"input": input_accessor, "output": output_accessor, "interpolation": "LINEAR"})
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


def write(path: str, document: dict, chunks: list[tuple[bytes, int]], length: int) -> None:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    padding = -length % 4
    total = 12 + 8 + len(text) + 8 + length + padding
    with open(path, "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, total))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", length + padding, b"BIN\0"))
        for data, size in chunks:
            for _ in range(size // len(data)):
                file.write(data)
            file.write(data[: size % len(data)])
        file.write(b"\0" * padding)


if __name__ == "__main__":
    main(*sys.argv[1:])
