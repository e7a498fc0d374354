# SPDX-License-Identifier: GPL-3.0-or-later
"""Pose arrays as the archive that the service reads and writes."""

import io
import json

import numpy as np


def encode(arrays):
    room = io.BytesIO()
    meta = np.array(json.dumps(arrays["meta"]))
    np.savez(room, **{key: value for key, value in arrays.items() if key != "meta"}, meta=meta)
    return room.getvalue()


def decode(data):
    with np.load(io.BytesIO(data), allow_pickle=False) as archive:
        arrays = {key: archive[key] for key in archive.files}
    arrays["meta"] = json.loads(str(arrays["meta"])) if "meta" in arrays else {}
    return arrays
