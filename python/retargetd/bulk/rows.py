"""The rows of a table, and their names."""

from __future__ import annotations

import csv
import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Row:
    """One retarget: a clip onto a character."""

    index: int
    """Its place in the table, from 0."""
    source: str
    target: str
    config: str | None
    """JSON, or the path of a config; nothing where everything is found out."""
    name: str
    """What the result is called."""

    @property
    def key(self) -> str:
        """Names what is to be done: the same row of the same table has the same one."""
        words = json.dumps([self.index, self.source, self.target, self.config, self.name])
        return hashlib.sha256(words.encode()).hexdigest()[:24]

    @property
    def pair(self) -> tuple[str, str]:
        """Rows of one character and config have much in common."""
        return self.target, self.config or ""


def rows_of(table: Iterable[Row | Mapping[str, Any]]) -> list[Row]:
    """Rows of what has the columns ``source``, ``target``, and where it likes ``config`` and ``name``: dictionaries, or a table of
    pandas."""
    to_dict = getattr(table, "to_dict", None)
    records: Iterable[Any] = to_dict("records") if to_dict is not None else table
    rows: list[Row] = []
    names: set[str] = set()
    for index, record in enumerate(records):
        if isinstance(record, Row):
            names.add(record.name)
            rows.append(record)
            continue
        missing = [column for column in ("source", "target") if _is_empty(record.get(column))]
        if missing:
            raise ValueError(f"row {index} has no {' and no '.join(missing)}")
        config = record.get("config")
        if isinstance(config, Mapping):
            config = json.dumps(config, sort_keys=True)
        source = os.fspath(record["source"])
        given = record.get("name")
        name = _plain(str(given)) if not _is_empty(given) else f"{index:06}-{_plain(Path(source).stem)}"
        if name in names:
            raise ValueError(f"row {index}: another row is called '{name}' too; give each row a name of its own")
        names.add(name)
        rows.append(Row(index, source, os.fspath(record["target"]), None if _is_empty(config) else str(config), name))
    return rows


def read_table(path: str | os.PathLike[str]) -> list[Row]:
    """Rows of a ``.csv``, ``.jsonl`` or ``.parquet`` file. Paths in it that are relative are looked up beside it."""
    place = Path(path)
    ending = place.suffix.lower()
    if ending == ".parquet":
        import pyarrow.parquet

        records = pyarrow.parquet.read_table(place).to_pylist()
    elif ending in (".jsonl", ".ndjson"):
        records = [json.loads(line) for line in place.read_text(encoding="utf-8").splitlines() if line.strip()]
    elif ending == ".csv":
        with place.open(newline="", encoding="utf-8") as file:
            records = list(csv.DictReader(file))
    else:
        raise ValueError(f"{place}: a table is a .csv, .jsonl or .parquet file")

    def beside(value: object) -> object:
        is_path = isinstance(value, str) and value != "" and "://" not in value
        return str(place.parent / str(value)) if is_path else value

    for record in records:
        for column in ("source", "target"):
            record[column] = beside(record.get(column))
        config = record.get("config")
        if isinstance(config, str) and config.strip() and not config.lstrip().startswith("{"):
            record["config"] = beside(config)
    return rows_of(records)


def _is_empty(value: object) -> bool:
    # A missing cell is a float that is not itself in pandas.
    return value is None or value == "" or value != value


def _plain(name: str) -> str:
    plain = "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in name)
    return plain.strip(".")[:100] or "row"
