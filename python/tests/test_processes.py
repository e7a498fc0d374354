"""Processes and threads: isolation, Ctrl-C, forks, memory, speed."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import retargetd as rt

from conftest import LONG, skip


def script(code: str, *options: str, timeout: float = 120) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *options, "-c", code], capture_output=True, text=True, timeout=timeout, check=False
    )


def test_an_isolated_engine_says_the_same(walk: bytes, mannequin: bytes) -> None:
    assert rt.inspect(walk, isolate=True) == rt.inspect(walk)
    assert rt.retarget(walk, mannequin, isolate=True).data == rt.retarget(walk, mannequin).data
    assert rt.preview(walk, ending="png", size=64, isolate=True) == rt.preview(walk, ending="png", size=64)


def test_an_engine_process_that_dies_costs_its_call_only() -> None:
    """A build with debug assertions dies when it is told to; builds for users have no such place."""
    code = """
import os
os.environ["RETARGETD_FAILPOINT"] = "engine"
import retargetd as rt
walk = rt.samples()[0]
for name in ("abort.glb", "overflow.glb"):
    try:
        rt.inspect(rt.File(name, walk), isolate=True)
        print("no such place")
    except rt.Failed as error:
        print(error.code)
print(len(rt.inspect(walk, isolate=True)["clips"]))
"""
    ran = script(code)
    words = ran.stdout.splitlines()
    assert ran.returncode == 0 and words[-1] == "1", ran.stderr
    assert words[:2] in (["engine_crashed"] * 2, ["no such place"] * 2), words


def test_hostile_files_raise_and_nothing_else(corpus: Path) -> None:
    files = sorted(path for path in (corpus / "hostile").rglob("*") if path.is_file())
    assert len(files) > 10
    readable = 0
    for path in files:
        try:
            rt.inspect(path, isolate=True)
            readable += 1
        except rt.Error as error:
            assert error.code and str(error), path
    print(f"{len(files)} hostile files: {len(files) - readable} refused, {readable} read")
    assert rt.inspect(rt.samples()[0], isolate=True), "the next call works"


def test_ctrl_c_cancels() -> None:
    code = """
import os, signal, threading, time
import retargetd as rt
walk, mannequin = rt.samples()
poses = rt.Poses.read(walk)
import numpy as np
from dataclasses import replace
long = replace(poses, **{key: np.tile(getattr(poses, key), (120, 1, 1)) for key in ("translations", "rotations", "scales")},
               times=np.arange(121 * 120) / 30, contacts=None)
# Who starts the tests in the background of a shell has them ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)
threading.Timer(0.4, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
begin = time.monotonic()
try:
    while True:
        rt.retarget(long, mannequin)
except KeyboardInterrupt:
    print("interrupted", time.monotonic() - begin)
print(len(rt.inspect(walk)["clips"]))
"""
    ran = script(code)
    words = ran.stdout.split()
    assert words[0] == "interrupted" and words[-1] == "1", ran.stderr
    assert float(words[1]) < 20, "it stops soon"


def test_other_threads_run_meanwhile(walk: bytes, mannequin: bytes) -> None:
    counted = 0
    stop = threading.Event()

    def count() -> None:
        nonlocal counted
        while not stop.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    begin = time.monotonic()
    rt.retarget(walk, mannequin)
    took = time.monotonic() - begin
    stop.set()
    thread.join()
    assert counted > took * 50, f"{counted} in {took} s"


def test_a_forked_process_works_too(walk: bytes, mannequin: bytes) -> None:
    """The threads of the parent are not there after a fork, and its engine processes are the parent's."""
    code = """
import multiprocessing, sys
import retargetd as rt
walk, mannequin = rt.samples()
wanted = rt.retarget(walk, mannequin).data
assert rt.inspect(walk, isolate=True)
def work(_):
    return rt.retarget(walk, mannequin).data == wanted and bool(rt.inspect(walk, isolate=True))
with multiprocessing.get_context("fork").Pool(2) as pool:
    print(pool.map_async(work, range(4)).get(100))
assert rt.inspect(walk, isolate=True)
"""
    ran = script(code, timeout=110)
    assert ran.stdout.strip() == str([True] * 4), ran.stderr


def test_calls_leave_nothing_behind() -> None:
    code = f"""
import gc, os, retargetd as rt
walk, mannequin = rt.samples()
plan = rt.Plan(walk, mannequin)
poses = rt.Poses.read(walk)
def rss():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
def call(number):
    rt.inspect(walk)
    plan.run(poses)
    if number % 20 == 0:
        rt.retarget(walk, mannequin).poses
    try:
        rt.inspect(b"nothing")
    except rt.Error:
        pass
for number in range({200 if LONG else 60}):
    call(number)
def least(calls):
    # Allocators give memory back when they like, so the least of several looks is what is really held.
    sizes = []
    for number in range(calls):
        call(number)
        if number % 20 == 19:
            gc.collect(); sizes.append(rss())
    return min(sizes)
before = least({200 if LONG else 60})
for number in range({800 if LONG else 0}):
    call(number)
print((least({200 if LONG else 60}) - before) / 1e6)
"""
    if not Path("/proc/self/statm").exists():
        skip("there is no /proc here")
    ran = script(code, timeout=900)
    assert ran.returncode == 0, ran.stderr
    print(f"grew by {ran.stdout.strip()} MB")
    assert float(ran.stdout) <= 5


def test_it_is_clean_in_development_mode() -> None:
    code = """
import retargetd as rt
walk, mannequin = rt.samples()
out = rt.retarget(walk, mannequin)
out.poses.global_positions(); out.measures; out.warnings; rt.inspect(walk, isolate=True)
rt.Plan(walk, mannequin).run(rt.Poses.read(walk))
try:
    rt.inspect(b"")
except rt.Error as error:
    print(error.code)
"""
    ran = script(code, "-X", "dev", "-W", "error")
    assert (ran.returncode, ran.stderr) == (0, ""), ran.stderr
    assert ran.stdout.strip() == "unsupported_format"


def test_what_takes_long_to_load_is_loaded_when_it_is_used() -> None:
    code = """
import sys
import retargetd as rt
rt.inspect(rt.samples()[0])
assert not {"numpy", "http.client", "ssl"} & set(sys.modules)
assert rt.Poses.read(rt.samples()[0]).frame_count == 121 and rt.Client.__name__ == "Client"
assert "numpy" in sys.modules
try:
    rt.Nothing
except AttributeError as error:
    print(error)
"""
    ran = script(code)
    assert ran.stdout.strip() == "module 'retargetd' has no attribute 'Nothing'", ran.stderr


def test_numpy_is_all_that_it_imports() -> None:
    code = """
import sys
import retargetd
retargetd.Poses, retargetd.Plan, retargetd.Client
third = {name.split(".")[0] for name, module in sys.modules.items()
         if "site-packages" in (getattr(module, "__file__", None) or "")}
print(sorted(name for name in third - {"retargetd", "numpy"} if not name.startswith("_")))
"""
    ran = script(code)
    assert ran.stdout.strip() == "[]", ran.stdout + ran.stderr


@pytest.mark.long
def test_four_threads_are_faster_than_one(walk: bytes, mannequin: bytes) -> None:
    from concurrent.futures import ThreadPoolExecutor

    os.environ.setdefault("RAYON_NUM_THREADS", "1")
    begin = time.monotonic()
    for _ in range(12):
        rt.retarget(walk, mannequin)
    alone = time.monotonic() - begin
    begin = time.monotonic()
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: rt.retarget(walk, mannequin), range(12)))
    together = time.monotonic() - begin
    print(f"{alone / together:.2f} times as fast; peak {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss} kB")
    assert alone / together > 1.2
