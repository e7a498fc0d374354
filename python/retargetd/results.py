"""What comes out of the engine."""

from __future__ import annotations

import base64
import html
import json
import os
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _engine

if TYPE_CHECKING:
    from .poses import Poses


class Warned(NamedTuple):
    """A deviation, a guess or a loss."""

    code: str
    place: str
    detail: str
    hint: str


class Output(NamedTuple):
    """One file that came out."""

    format: str
    name: str
    data: bytes


class Measure(NamedTuple):
    """One measure of a result."""

    name: str
    value: float | None
    unit: str
    verdict: str
    worst: str


class Measures(tuple[Measure, ...]):
    """The measures of a result; a notebook shows them as a table."""

    __slots__ = ()

    def to_pandas(self) -> Any:
        """A table of pandas, one row a measure."""
        import pandas

        return pandas.DataFrame(list(self), columns=list(Measure._fields)).set_index("name")

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{name}</th>" for name in Measure._fields)
        rows = "".join(
            "<tr>" + "".join(f"<td>{html.escape(_cell(cell))}</td>" for cell in row) + "</tr>" for row in self
        )
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


class Picture(bytes):
    """An encoded picture; a notebook shows it."""

    media_type: str

    def __new__(cls, data: bytes, media_type: str) -> Picture:
        picture = super().__new__(cls, data)
        picture.media_type = media_type
        return picture

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes it to a file."""
        write_whole(path, self)

    def __repr__(self) -> str:
        return f"<Picture {self.media_type}, {len(self)} bytes>"

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        return {"text/plain": repr(self), "text/html": self._html()}

    def _html(self) -> str:
        kind = "video" if self.media_type.startswith("video/") else "img"
        data = base64.b64encode(self).decode()
        attributes = " autoplay loop muted" if kind == "video" else ""
        return f'<{kind}{attributes} src="data:{self.media_type};base64,{data}"></{kind}>'


class Result:
    """What a retarget, an edit or a pose gave.

    >>> import retargetd as rt
    >>> out = rt.retarget(*rt.samples())
    >>> out.report["counts"]["frames"]
    121
    >>> out.data[:4]
    b'glTF'
    """

    def __init__(self, ran: _engine.Ran, again: Callable[[list[str]], _engine.Ran]) -> None:
        self._ran = ran
        self._again = again
        self._made = {output[0]: Output(*output) for output in ran.outputs}

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The files, in the order of the formats that were asked for."""
        return tuple(Output(*output) for output in self._ran.outputs)

    @property
    def data(self) -> bytes:
        """The bytes of the first file."""
        return self._ran.outputs[0][2]

    @cached_property
    def report(self) -> dict[str, Any]:
        """What was measured and found out; docs/reference/metrics.md explains the measures."""
        report: dict[str, Any] = json.loads(self._ran.report)
        return report

    @cached_property
    def resolved_spec(self) -> dict[str, Any]:
        """The config with everything found out filled in; run again, it gives the same result."""
        spec: dict[str, Any] = json.loads(self._ran.resolved_spec)
        return spec

    @cached_property
    def warnings(self) -> tuple[Warned, ...]:
        """Deviations, guesses and losses."""
        return tuple(
            Warned(warning["code"], warning["place"], warning["detail"], warning["hint"])
            for warning in self.report["warnings"]
        )

    @property
    def verdict(self) -> str:
        """``pass``, ``warn``, ``fail``, or ``not_applicable`` where nothing could be measured."""
        measures = self.report.get("measures") or {}
        return str(measures.get("verdict", "not_applicable"))

    @cached_property
    def measures(self) -> Measures:
        """The measures, one row each."""
        metrics: Mapping[str, Mapping[str, Any]] = (self.report.get("measures") or {}).get("metrics", {})
        return Measures(_measure(name, metric) for name, metric in metrics.items())

    @cached_property
    def poses(self) -> Poses:
        """The result as arrays: those that are in the NPZ."""
        from .poses import Poses

        return Poses.from_npz(self.to_bytes("npz"))

    def to_bytes(self, format: str) -> bytes:
        """The result in a format, by its name or the ending of a file name. One that was not asked for is made now, by doing
        the work again."""
        name = _format_name(format)
        if name not in self._made:
            ran = self._again([name])
            self._made[name] = Output(*ran.outputs[0])
        return self._made[name].data

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the result; the ending picks the format. The file appears whole or not at all."""
        write_whole(path, self.to_bytes(Path(path).suffix))

    def write_report(self, path: str | os.PathLike[str]) -> None:
        """Writes the report as JSON, as the command line does."""
        report = {**self.report, "resolved_spec": self.resolved_spec}
        write_whole(path, (json.dumps(report, indent=2, ensure_ascii=False) + "\n").encode())

    def preview(self, path: str | os.PathLike[str] | None = None, **view: Any) -> Picture:
        """What it looks like: as :func:`retargetd.preview`."""
        from .functions import preview

        output = next((output for output in self.outputs if not output.format.startswith("poses")), self.outputs[0])
        from .files import File

        return preview(File(output.name, output.data), path, **view)

    def plot(self, curve: str = "slide_speed", axes: Any = None) -> Any:
        """Draws values over time with matplotlib, where it is there: ``limb_direction``, ``sole_height``, ``slide_speed``. Gives the
        axes."""
        curves = (self.report.get("measures") or {}).get("curves", {})
        if curve not in curves:
            raise ValueError(f"there is no curve '{curve}'; the report has: {', '.join(curves) or 'none'}")
        if axes is None:
            from matplotlib import pyplot

            axes = pyplot.figure().subplots()
        for part, values in curves[curve]["parts"].items():
            axes.plot(curves[curve]["times_seconds"], [float("nan") if value is None else value for value in values], label=part)
        axes.set_xlabel("seconds")
        axes.set_ylabel(f"{curve.replace('_', ' ')} ({curves[curve]['unit']})")
        axes.legend()
        return axes

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        picture = self.preview(size=256, fps=15)
        page = f"<div>{picture._html()}<p>{html.escape(repr(self))}</p>{self.measures._repr_html_()}</div>"
        return {"text/plain": repr(self), "text/html": page}

    def __repr__(self) -> str:
        counts = self.report["counts"]
        return f"<Result: {counts['frames']} frames, {counts['target_joints']} joints, verdict {self.verdict}>"


def write_whole(path: str | os.PathLike[str], data: bytes) -> None:
    """Writes a file so that it appears whole or not at all."""
    place = Path(path)
    staged = place.with_name(f".{place.name}.{os.getpid()}.part")
    try:
        staged.write_bytes(data)
        os.replace(staged, place)
    finally:
        staged.unlink(missing_ok=True)


def _format_name(format: str) -> str:
    ending = format.lower().lstrip(".")
    for known in json.loads(_engine.formats()):
        if known["name"] == format or (known["writes"] and ending in known["endings"]):
            return str(known["name"])
    raise ValueError(f"'{format}' is no format that is written; retargetd.formats() lists them")


def _measure(name: str, metric: Mapping[str, Any]) -> Measure:
    worst: Mapping[str, Any] = next(iter(metric.get("worst") or ()), {})
    parts: Iterator[str] = (f"{key} {value}" for key, value in worst.items() if value not in (None, ""))
    return Measure(
        name,
        metric.get("value"),
        str(metric.get("unit", "")),
        str(metric.get("verdict", "")),
        ", ".join(parts),
    )


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)
