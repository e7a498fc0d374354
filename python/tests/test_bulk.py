"""Tables of rows: every row ends exactly once in the table, whatever dies on the way."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest
import retargetd as rt
from retargetd import bulk

from conftest import LONG, skip


def table(files: tuple[Path, Path], count: int, bad: int) -> list[dict[str, Any]]:
    """Rows, some of which cannot be done, each for another reason."""
    reasons = [
        {"source": str(files[0].with_name("none.glb"))},
        {"config": {"algin": "off"}},
        {"source": str(files[1])},
        {"target": str(files[0].with_name("broken.glb"))},
    ]
    files[0].with_name("broken.glb").write_bytes(b"no model")
    rows: list[dict[str, Any]] = []
    for number in range(count):
        row: dict[str, Any] = {"source": str(files[0]), "target": str(files[1]), "config": {"report": "summary"}}
        if number % max(1, count // max(1, bad)) == 0 and sum("bad" in row for row in rows) < bad:
            row |= {**reasons[number // max(1, count // bad) % 4], "bad": True}
        rows.append(row)
    return rows


def read(path: str) -> list[dict[str, Any]]:
    if path.endswith(".csv"):
        with open(path, newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))
    import pyarrow.parquet

    records: list[dict[str, Any]] = pyarrow.parquet.read_table(path).to_pylist()
    return records


def check(summary: bulk.Summary, rows: list[dict[str, Any]], output: Path) -> None:
    bad = sum("bad" in row for row in rows)
    assert (summary.rows, summary.done, summary.failed) == (len(rows), len(rows) - bad, bad), summary
    records = read(summary.table)
    assert sorted(int(record["index"]) for record in records) == list(range(len(rows))), "each row exactly once"
    for record in records:
        is_bad = "bad" in rows[int(record["index"])]
        assert record["status"] == ("failed" if is_bad else "done"), record
        if is_bad:
            assert record["code"] and record["detail"], record
        else:
            assert record["verdict"] in ("pass", "warn") and (output / record["result"]).stat().st_size > 1000


@pytest.mark.parametrize("engine", ["here", "pool"])
def test_a_table_and_the_same_again(files: tuple[Path, Path], tmp_path: Path, engine: str) -> None:
    rows = table(files, 8, 4)
    told: list[tuple[int, int]] = []
    summary = bulk.run(rows, tmp_path, engine=engine, workers=2, progress=lambda done, all: told.append((done, all)))
    check(summary, rows, tmp_path)
    assert summary.ran == 8 and told[-1] == (8, 8)
    results = {path: path.stat().st_mtime_ns for path in (tmp_path / "results").iterdir()}
    assert len(results) == 4
    again = bulk.run(rows, tmp_path, engine=engine, workers=2)
    assert again.ran == 0 and (again.done, again.failed) == (summary.done, summary.failed)
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "results").iterdir()} == results
    assert bulk.run(rows, tmp_path, engine="here", retry_failed=True).ran == 4


def test_results_are_those_of_the_engine(files: tuple[Path, Path], tmp_path: Path) -> None:
    bulk.run([{"source": files[0], "target": files[1], "name": "walk"}], tmp_path, engine="here")
    assert (tmp_path / "results/walk.glb").read_bytes() == rt.retarget(*files).data


def test_rows_by_plans(files: tuple[Path, Path], tmp_path: Path) -> None:
    rows = [{"source": str(files[0]), "target": str(files[1]), "name": name} for name in "abc"]
    summary = bulk.run(rows, tmp_path, engine="here", plans=True)
    assert summary.verdicts == {"not_measured": 3}
    poses = rt.Poses.from_npz(tmp_path / "results/b.npz")
    assert abs(poses.rotations - rt.retarget(*files).poses.rotations).max() < 1e-4


def test_a_worker_that_is_killed_costs_nothing(files: tuple[Path, Path], tmp_path: Path) -> None:
    """A worker is killed in the middle; its rows are done again."""
    count, bad = (2000, 20) if LONG else (16, 2)
    rows = table(files, count, bad)
    killed = kill_a_worker(tmp_path, count // 4)
    summary = bulk.run(rows, tmp_path, workers=2)
    assert killed(), "a worker was killed"
    check(summary, rows, tmp_path)


def kill_a_worker(output: Path, after: int, kind: bytes = b"spawn_main") -> Any:
    """Kills one process below this one, whose command line has `kind` in it, when so many rows are done; what it gives says whether
    it did."""
    victims: list[int] = []

    def watch() -> None:
        end = time.monotonic() + 900
        while time.monotonic() < end:
            done = len(list((output / "records").glob("*.json"))) if (output / "records").is_dir() else 0
            workers = [child for child in descendants(os.getpid()) if kind in command_line(child)] if done >= after else []
            if workers:
                victims.append(workers[-1])
                os.kill(victims[0], signal.SIGKILL)
                return
            time.sleep(0.01)

    if not Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").exists():
        skip("this system does not tell the children of a process")
    thread = threading.Thread(target=watch, daemon=True)
    thread.start()

    def was_killed() -> bool:
        thread.join(10)
        return bool(victims)

    return was_killed


def descendants(process: int) -> list[int]:
    children: list[int] = []
    for path in Path(f"/proc/{process}/task").glob("*/children"):
        try:
            children += [int(child) for child in path.read_text().split()]
        except OSError:
            continue
    return [*children, *(below for child in children for below in descendants(child))]


def command_line(process: int) -> bytes:
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes()
    except OSError:
        return b""


def test_tables_are_read_from_files(files: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "walk.glb").write_bytes(files[0].read_bytes())
    (tmp_path / "mannequin.glb").write_bytes(files[1].read_bytes())
    (tmp_path / "config.yaml").write_text("align: 'off'\n")
    text = "source,target,config,name\nwalk.glb,mannequin.glb,,a\nwalk.glb,mannequin.glb,config.yaml,b\n"
    (tmp_path / "rows.csv").write_text(text)
    rows = bulk.read_table(tmp_path / "rows.csv")
    assert [row.name for row in rows] == ["a", "b"] and rows[0].config is None
    (tmp_path / "rows.jsonl").write_text('{"source": "walk.glb", "target": "mannequin.glb", "config": {"align": "off"}}\n')
    assert bulk.read_table(tmp_path / "rows.jsonl")[0].config == '{"align": "off"}'
    assert bulk.run(rows, tmp_path / "out", engine="here").done == 2
    with pytest.raises(ValueError, match="row 0 has no target"):
        bulk.run([{"source": "walk.glb"}], tmp_path / "out")
    with pytest.raises(ValueError, match="another row"):
        bulk.run([{"source": "a", "target": "b", "name": "x"}] * 2, tmp_path / "out")


def test_results_go_to_what_fsspec_knows(files: tuple[Path, Path], tmp_path: Path) -> None:
    pytest.importorskip("fsspec")
    rows = table(files, 3, 1)
    output = f"local://{tmp_path}/out"
    summary = bulk.run(rows, output, engine="here")
    assert (summary.done, summary.failed) == (2, 1)
    assert bulk.run(rows, output, engine="here").ran == 0


def test_a_service_does_the_same_table(files: tuple[Path, Path], tmp_path: Path, service: str) -> None:
    rows = table(files, 5, 3)
    client = rt.Client(service)
    summary = bulk.service(rows, tmp_path, client)
    check(summary, rows, tmp_path)
    assert bulk.service(rows, tmp_path, client).ran == 0
    record = next(record for record in read(summary.table) if record["status"] == "done")
    assert (tmp_path / record["result"]).read_bytes() == rt.retarget(*files, {"report": "summary"}).data
    assert json.loads(next((tmp_path / "records").iterdir()).read_text())["key"]


DEADLY = """
import os, signal
from fsspec.spec import AbstractFileSystem

class Deadly(AbstractFileSystem):
    protocol = "deadly"
    def _open(self, path, **_):
        os.kill(os.getpid(), signal.SIGKILL)
"""

DEADLY_TABLE = """
import sys
from retargetd import bulk

if __name__ == "__main__":
    source, target, output, engine = sys.argv[1:]
    rows = [{"source": source, "target": target} for _ in range(6)]
    rows[2]["source"] = "deadly://clip.glb"
    for ran in (6, 0):
        summary = bulk.run(rows, output, engine=engine, workers=2)
        assert (summary.rows, summary.done, summary.failed, summary.ran) == (6, 5, 1, ran), summary
"""


@pytest.mark.parametrize("engine", ["pool", *(["ray", "dask"] if LONG else [])])
def test_a_row_that_brings_its_workers_down_has_failed(files: tuple[Path, Path], tmp_path: Path, engine: str) -> None:
    """And it takes no other row along."""
    for module in ("fsspec", {"ray": "ray.data", "dask": "distributed"}.get(engine, "fsspec")):
        pytest.importorskip(module)
    # A store that fsspec finds as it finds those that are installed; whoever opens a file of it dies.
    (tmp_path / "deadly.py").write_text(DEADLY)
    about = tmp_path / "deadly-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: deadly\nVersion: 1\n")
    (about / "entry_points.txt").write_text("[fsspec.specs]\ndeadly = deadly.Deadly\n")
    (tmp_path / "main.py").write_text(DEADLY_TABLE)
    words = [sys.executable, str(tmp_path / "main.py"), str(files[0]), str(files[1]), str(tmp_path / "out"), engine]
    paths = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    ran = subprocess.run(
        words, capture_output=True, text=True, timeout=400, check=False, env={**os.environ, "PYTHONPATH": paths}
    )
    assert ran.returncode == 0, ran.stderr
    records = [json.loads(path.read_text()) for path in (tmp_path / "out/records").iterdir()]
    assert [record["source"] for record in records if record.get("code") == "worker_died"] == ["deadly://clip.glb"]


def test_failed_rows_are_done_again_in_chunks_too(files: tuple[Path, Path], tmp_path: Path) -> None:
    """As Ray and Dask do them."""
    from retargetd.bulk.engines import _do_chunk
    from retargetd.bulk.rows import rows_of
    from retargetd.bulk.work import Job

    late = tmp_path / "late.glb"
    rows = rows_of([{"source": late, "target": files[1]}, {"source": files[0], "target": files[1]}])
    output = tmp_path / "out"
    _do_chunk(Job(str(output)), rows)
    first = bulk.collect(rows, output)
    assert (first.done, first.failed) == (1, 1)
    late.write_bytes(files[0].read_bytes())
    _do_chunk(Job(str(output)), rows)
    assert bulk.collect(rows, output).failed == 1, "what has a record is left alone"
    result = output / "results" / f"{rows[1].name}.glb"
    before = result.stat().st_mtime_ns
    _do_chunk(Job(str(output), retry_failed=True), rows)
    assert bulk.collect(rows, output).done == 2 and result.stat().st_mtime_ns == before


@pytest.mark.long
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("engine", ["ray", "dask"])
def test_the_same_on_ray_and_dask(files: tuple[Path, Path], tmp_path: Path, engine: str) -> None:
    pytest.importorskip("ray" if engine == "ray" else "distributed")
    count = int(os.environ.get("RETARGETD_TEST_ROWS", "2000"))
    rows = table(files, count, 20 if count >= 100 else 2)
    # A task of Ray names its process.
    killed = kill_a_worker(tmp_path, count // 4, b"ray::Map" if engine == "ray" else b"spawn_main")
    begin = time.monotonic()
    summary = bulk.run(rows, tmp_path, engine=engine, workers=2)
    print(f"{engine}: {count} rows in {time.monotonic() - begin:.1f} s, a worker killed: {killed()}")
    assert killed()
    check(summary, rows, tmp_path)
    assert bulk.run(rows, tmp_path, engine=engine, workers=2).ran == 0


@pytest.mark.long
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("engine", ["pool", "ray", "dask"])
def test_two_workers_are_faster_than_one(files: tuple[Path, Path], tmp_path: Path, engine: str) -> None:
    """On two cores that nobody else wants, nearly twice; what starting them takes is left out."""
    pytest.importorskip({"ray": "ray.data", "dask": "distributed"}.get(engine, "retargetd"))
    count = int(os.environ.get("RETARGETD_TEST_ROWS", "1000")) // 2

    def rows_per_second(workers: int, output: Path) -> float:
        begin = time.monotonic()
        bulk.run(table(files, count // 10, 0), output / "few", engine=engine, workers=workers)
        few = time.monotonic() - begin
        begin = time.monotonic()
        bulk.run(table(files, count, 0), output / "many", engine=engine, workers=workers)
        return (count - count // 10) / (time.monotonic() - begin - few)

    rates = [(rows_per_second(2, tmp_path / f"{turn}two"), rows_per_second(1, tmp_path / f"{turn}one")) for turn in range(2)]
    gains = [two / one for two, one in rates]
    print(f"{engine}: two workers are {' and '.join(f'{gain:.2f}' for gain in gains)} times one; {rates}")
    assert max(gains) > 1.3
