"""The types of a config are those of the schema."""

from __future__ import annotations

import os

import retargetd as rt

import config_types
from conftest import PYTHON


def test_config_types_are_those_of_the_schema() -> None:
    path = PYTHON / "retargetd/config.py"
    wanted = config_types.module(rt.schema())
    if os.environ.get("RETARGETD_UPDATE") == "1":
        path.write_text(wanted, encoding="utf-8")
    assert path.read_text(encoding="utf-8") == wanted, "RETARGETD_UPDATE=1 writes it anew"


def test_a_typed_config_is_taken() -> None:
    from retargetd import config

    spec: config.RetargetSpec = {"edit": {"fps": 30}, "ops": [{"op": "pelvis"}, {"op": "fk"}]}
    assert rt.retarget(*rt.samples(), spec).poses.fps == 30
