"""What a worker does with one row."""

from __future__ import annotations

import json
import time
from collections import OrderedDict
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..errors import Error
from ..files import File
from .places import Place, place_of, read_input
from .rows import Row

# Characters and plans that a worker keeps: few, since each may be large, and rows come sorted by them.
_MOST_KEPT = 4


@dataclass(frozen=True)
class Job:
    """What is done with every row."""

    output: str
    format: str = "glb"
    isolate: bool = False
    plans: bool = False
    retry_failed: bool = False


class Worker:
    """Does one row after the other, and keeps what the next ones need again."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._place: Place = place_of(job.output)
        self._files: OrderedDict[str, File] = OrderedDict()
        self._plans: OrderedDict[tuple[str, ...], Any] = OrderedDict()

    def do(self, row: Row) -> dict[str, Any]:
        """Does a row and writes down what became of it; never raises for what is wrong with the row."""
        begin = time.monotonic()
        record = {**_blank(row), **self._outcome(row)}
        record["seconds"] = round(time.monotonic() - begin, 4)
        self._place.put(f"records/{row.key}.json", json.dumps(record).encode())
        return record

    def _outcome(self, row: Row) -> dict[str, Any]:
        try:
            return self._planned(row) if self._job.plans else self._retargeted(row)
        except Error as error:
            problem = {"code": error.code, "detail": str(error), "pointer": error.pointer, "hint": error.hint}
            return {"status": "failed", **problem}
        # Stores that fsspec knows raise what they like.
        except Exception as error:
            return {"status": "failed", "code": "unreadable", "detail": f"{type(error).__name__}: {error}"}

    def _retargeted(self, row: Row) -> dict[str, Any]:
        import retargetd as rt

        out = rt.retarget(
            read_input(row.source),
            self._file(row.target),
            _config(row.config),
            formats=[self._job.format],
            isolate=self._job.isolate,
        )
        output = out.outputs[0]
        result = f"results/{row.name}{Path(output.name).suffix}"
        self._place.put(result, output.data)
        measures = out.report.get("measures") or {}
        metrics = {f"measure_{metric.name}": metric.value for metric in out.measures}
        return {
            "status": "done",
            "result": result,
            "frames": out.report["counts"]["frames"],
            "warnings": len(out.warnings),
            "verdict": out.verdict,
            "verdict_reason": measures.get("verdict_reason", ""),
            "score": measures.get("score"),
            **metrics,
        }

    def _planned(self, row: Row) -> dict[str, Any]:
        """By the plan of the pair, which is compiled once: pose arrays come out, and nothing is measured."""
        import retargetd as rt

        source = read_input(row.source)
        poses = rt.Poses.read(source, (_config_document(row.config) or {}).get("clip"))
        skeleton = (*poses.joint_names, poses.parents.tobytes().hex(), poses.rest_translations.tobytes().hex())
        key = (row.target, row.config or "", *skeleton)
        plan = self._plans.get(key)
        if plan is None:
            plan = rt.Plan(source, self._file(row.target), _config(row.config))
            _keep(self._plans, key, plan)
        made = plan.run(poses)
        result = f"results/{row.name}.npz"
        self._place.put(result, made.to_bytes())
        return {"status": "done", "result": result, "frames": made.frame_count, "verdict": "not_measured"}

    def _file(self, path: str) -> File:
        """A character, which many rows share."""
        found = self._files.get(path)
        if found is None:
            from ..files import read

            found = File(*read(read_input(path), "target"))
            _keep(self._files, path, found)
        return found


def died(job: Job, row: Row) -> dict[str, Any]:
    """Writes down that a row brings workers down, again and again."""
    problem = {
        "code": "worker_died",
        "detail": "the process that worked on it died, also when it worked on nothing else",
        "hint": "run with isolate=True to see why",
    }
    record = {**_blank(row), "status": "failed", **problem}
    place_of(job.output).put(f"records/{row.key}.json", json.dumps(record).encode())
    return record


def _blank(row: Row) -> dict[str, Any]:
    return {**asdict(row), "key": row.key}


def _keep(kept: OrderedDict[Any, Any], key: Any, value: Any) -> None:
    kept[key] = value
    while len(kept) > _MOST_KEPT:
        kept.popitem(last=False)


def _config(config: str | None) -> Any:
    if config is None:
        return None
    return config.encode() if config.lstrip().startswith("{") else read_input(config)


def _config_document(config: str | None) -> dict[str, Any] | None:
    if config is None or not config.lstrip().startswith("{"):
        return None
    document: dict[str, Any] = json.loads(config)
    return document
