"""What several tests need: the samples, the corpus of real files, the command line, a running service."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import retargetd as rt

PYTHON = Path(__file__).resolve().parent.parent
PROJECT = PYTHON.parent
SHARED = Path(os.environ.get("RETARGETD_SHARED", PROJECT.parent / "shared"))
LONG = os.environ.get("RETARGETD_LONG") == "1"


def skip(reason: str) -> None:
    """Skips aloud: the test command shows the reasons, and counts them."""
    pytest.skip(reason)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if LONG:
        return
    mark = pytest.mark.skip(reason="long: RETARGETD_LONG=1 runs it")
    for item in items:
        if "long" in item.keywords:
            item.add_marker(mark)


@pytest.fixture(scope="session")
def walk() -> bytes:
    return rt.samples()[0]


@pytest.fixture(scope="session")
def mannequin() -> bytes:
    return rt.samples()[1]


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The samples as files."""
    folder = tmp_path_factory.mktemp("samples")
    walk, mannequin = rt.samples()
    (folder / "walk.glb").write_bytes(walk)
    (folder / "mannequin.glb").write_bytes(mannequin)
    return folder / "walk.glb", folder / "mannequin.glb"


@pytest.fixture(scope="session")
def corpus() -> Path:
    """The corpus of real files, which is not part of the project."""
    if not (SHARED / "corpus").is_dir():
        skip(f"{SHARED / 'corpus'} is not there")
    return SHARED / "corpus"


def command() -> list[str]:
    """The command line to compare with: that of a build of the project where there is one, else that of the wheel."""
    built = os.environ.get("RETARGETD_COMMAND")
    return [built] if built else [sys.executable, "-m", "retargetd"]


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    words = [*command(), *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a service that the wheel's own command runs."""
    data = tmp_path_factory.mktemp("service")
    log = data / "log"
    words = [sys.executable, "-m", "retargetd", "serve", "--listen", "127.0.0.1:0", "--data", str(data / "data")]
    with log.open("wb") as told:
        process = subprocess.Popen([*words, "--workers", "2"], stdout=told, stderr=told)
    try:
        end = time.monotonic() + 60
        while not (found := re.search(r"127\.0\.0\.1:([1-9]\d*)", log.read_text(errors="replace"))):
            assert process.poll() is None and time.monotonic() < end, log.read_text(errors="replace")
            time.sleep(0.05)
        yield f"http://127.0.0.1:{found[1]}"
    finally:
        process.terminate()
        try:
            process.wait(30)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
