"""What became of all rows, as one table."""

from __future__ import annotations

import csv
import io
import json
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .places import Place, place_of
from .rows import Row

_FIRST = (
    "index",
    "name",
    "source",
    "target",
    "config",
    "status",
    "verdict",
    "verdict_reason",
    "score",
    "result",
    "frames",
    "warnings",
    "seconds",
    "code",
    "detail",
    "pointer",
    "hint",
    "key",
)


@dataclass(frozen=True)
class Summary:
    """What a run did."""

    rows: int
    """Rows of the table."""
    done: int
    """Those that have a result."""
    failed: int
    """Those that have a problem."""
    ran: int
    """Those that this run did; the others were there."""
    verdicts: dict[str, int]
    """How many results are how good."""
    table: str
    """Where the table is."""


def collect(rows: Sequence[Row], output: str | os.PathLike[str], *, ran: int = 0) -> Summary:
    """Writes the table of what became of the rows: each is in it exactly once."""
    place = place_of(output)
    records = [record for row in rows if (record := record_of(place, row)) is not None]
    name, data = _encoded(records)
    place.put(name, data)
    states = Counter(str(record["status"]) for record in records)
    verdicts = Counter(str(record["verdict"]) for record in records if record.get("verdict"))
    return Summary(
        rows=len(rows),
        done=states["done"],
        failed=states["failed"],
        ran=ran,
        verdicts=dict(verdicts),
        table=f"{os.fspath(output)}/{name}",
    )


def record_of(place: Place, row: Row) -> dict[str, Any] | None:
    """What became of a row; nothing where nobody has done it."""
    try:
        record: dict[str, Any] = json.loads(place.get(f"records/{row.key}.json"))
    except (OSError, ValueError):
        return None
    return record


def _encoded(records: list[dict[str, Any]]) -> tuple[str, bytes]:
    found = dict.fromkeys(column for record in records for column in record)
    columns = [column for column in _FIRST if column in found]
    columns += sorted(column for column in found if column not in _FIRST)
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        text = io.StringIO()
        writer = csv.DictWriter(text, columns, restval="")
        writer.writeheader()
        writer.writerows(records)
        return "table.csv", text.getvalue().encode()
    filled = {column: [record.get(column) for record in records] for column in columns}
    room = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(filled), room)
    return "table.parquet", room.getvalue()
