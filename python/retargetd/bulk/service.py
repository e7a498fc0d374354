"""The same table for a service: batches in place of workers of one's own."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..client import Client, Job
from .places import place_of, read_input
from .rows import Row, rows_of
from .tables import Summary, collect

_MOST_ITEMS = 1000


def service(
    table: Iterable[Row | Mapping[str, Any]],
    output: str | os.PathLike[str],
    client: Client,
    *,
    format: str = "glb",
) -> Summary:
    """Has a service do all rows that are not done: files are uploaded once, and up to 1,000 rows are a batch."""
    rows = rows_of(table)
    place = place_of(output)
    there = place.names("records")
    todo = [row for row in rows if f"{row.key}.json" not in there]
    assets: dict[str, str] = {}

    def record(row: Row, outcome: dict[str, Any]) -> None:
        whole = {
            "index": row.index,
            "source": row.source,
            "target": row.target,
            "config": row.config,
            "name": row.name,
            "key": row.key,
            **outcome,
        }
        place.put(f"records/{row.key}.json", json.dumps(whole).encode())

    def asset(path: str) -> str:
        if path not in assets:
            assets[path] = client.upload(read_input(path), Path(path).name)
        return assets[path]

    for first in range(0, len(todo), _MOST_ITEMS):
        sent: list[Row] = []
        items: list[dict[str, Any]] = []
        for row in todo[first : first + _MOST_ITEMS]:
            try:
                item: dict[str, Any] = {"source": {"asset": asset(row.source)}, "target": {"asset": asset(row.target)}}
                if row.config is not None:
                    is_text = row.config.lstrip().startswith("{")
                    item["config"] = json.loads(row.config if is_text else Path(row.config).read_text(encoding="utf-8"))
            except (OSError, ValueError) as error:
                record(row, {"status": "failed", "code": "unreadable", "detail": f"{type(error).__name__}: {error}"})
                continue
            items.append({**item, "labels": {"name": row.name}})
            sent.append(row)
        if not items:
            continue
        batch = client.wait_batch(client.batch_of(items, output=[format]))
        for job in client.batch_jobs(batch):
            row = sent[job.get("batch_item") or 0]
            record(row, _outcome(client, job, row, place))
    return collect(rows, output, ran=len(todo))


def _outcome(client: Client, job: Job, row: Row, place: Any) -> dict[str, Any]:
    if job["state"] != "succeeded":
        problem = job.get("problem") or {}
        return {
            "status": "failed",
            "code": problem.get("code", job["state"]),
            "detail": problem.get("detail", f"the job was {job['state']}"),
            "hint": problem.get("hint", ""),
        }
    file = job["results"][0]
    result = f"results/{row.name}{Path(file['file_name']).suffix}"
    place.put(result, client.content(file))
    report = client.report(job)
    measures = report.get("measures") or {}
    metrics = {f"measure_{name}": metric.get("value") for name, metric in measures.get("metrics", {}).items()}
    return {
        "status": "done",
        "result": result,
        "frames": report["counts"]["frames"],
        "warnings": job["warnings_count"],
        "verdict": job.get("verdict") or "not_applicable",
        "verdict_reason": job.get("verdict_reason") or "",
        "score": measures.get("score"),
        **metrics,
    }
