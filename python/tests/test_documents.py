"""Every example of the docstrings and every Python block of the documents runs."""

from __future__ import annotations

import doctest
import importlib
import os
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest
import retargetd as rt

from conftest import PROJECT, PYTHON

MODULES = ["retargetd"] + [
    f"retargetd.{found.name}"
    for found in pkgutil.iter_modules(rt.__path__)
    if found.name not in ("_engine", "__main__", "bulk")
]
DOCUMENTS = [PROJECT / "README.md", PROJECT / "docs/guide/python.md", PYTHON / "README.md"]


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings(name: str) -> None:
    failed, _ = doctest.testmod(importlib.import_module(name), optionflags=doctest.ELLIPSIS)
    assert failed == 0


def blocks(path: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", path.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_python_blocks_of_the_documents(path: Path, tmp_path: Path, service: str) -> None:
    """One after the other in a folder with the samples, as a reader does. A block whose first line is a comment with `not run` is left
    out, and says why there."""
    walk, mannequin = rt.samples()
    (tmp_path / "walk.glb").write_bytes(walk)
    (tmp_path / "mannequin.glb").write_bytes(mannequin)
    found = [block for block in blocks(path) if "not run" not in block.splitlines()[0]]
    if path.name == "python.md":
        assert len(found) >= 5
    code = "\n".join(found).replace("http://127.0.0.1:8080", service)
    # Pools start other processes, which read the file of the main program again.
    body = "".join(f"    {line}\n" for line in code.splitlines())
    (tmp_path / "main.py").write_text(f"if __name__ == '__main__':\n{body}    pass\n")
    environment = {name: value for name, value in os.environ.items() if name != "RETARGETD_KEY"}
    ran = subprocess.run(
        [sys.executable, "-W", "error", "main.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=240,
        env=environment,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr


def test_types_are_strict() -> None:
    pytest.importorskip("mypy")
    ran = subprocess.run(
        [sys.executable, "-m", "mypy", "--cache-dir", os.devnull], cwd=PYTHON, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stdout


def test_stubs_are_those_of_the_module(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    allowed = tmp_path / "allowed"
    # What every module of PyO3 has.
    allowed.write_text("retargetd\\._engine\\.__all__\n")
    words = [sys.executable, "-m", "mypy.stubtest", "retargetd._engine", "--ignore-disjoint-bases", "--ignore-unused-allowlist"]
    words += ["--allowlist", str(allowed), "--mypy-config-file", str(PYTHON / "pyproject.toml")]
    # The module that is tested: that of an installed wheel, or of the sources where it was put beside them.
    beside = Path(rt.__file__).parents[1]
    environment = {**os.environ, **({} if "-packages" in beside.name else {"MYPYPATH": str(beside)})}
    ran = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, env=environment, check=False)
    assert ran.returncode == 0, ran.stdout


def test_all_that_is_public_is_explained() -> None:
    for name in rt.__all__:
        thing = getattr(rt, name)
        assert not callable(thing) or (thing.__doc__ or "").strip(), f"{name} has no docstring"
