"""A client of the service. It needs nothing but the standard library."""

from __future__ import annotations

import hashlib
import http.client
import json
import os
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

from .errors import Error, Failed, class_of, fields_of

if TYPE_CHECKING:
    from .files import FileLike

ENDED = ("succeeded", "failed", "canceled")
_TRIES = 6
_LONGEST_PAUSE_SECONDS = 20.0
_WAIT_SECONDS = 20


class Asset(TypedDict):
    """A file that the service has."""

    id: str
    file_name: str
    format: str
    bytes: int
    sha256: str


class ResultFile(TypedDict):
    """A file that a job gave."""

    id: str
    job: str
    format: str
    file_name: str
    bytes: int
    sha256: str
    content: str


class _JobMust(TypedDict):
    id: str
    state: str
    kind: str
    attempt: int
    labels: dict[str, str]
    results: list[ResultFile]
    warnings_count: int


class Job(_JobMust, total=False):
    """A job, as ``GET /v1/jobs/{id}`` has it; the OpenAPI document has every field."""

    progress: dict[str, Any] | None
    problem: dict[str, Any] | None
    verdict: str | None
    verdict_reason: str | None
    batch: str | None
    batch_item: int | None


class Batch(TypedDict):
    """A batch, as ``GET /v1/batches/{id}`` has it."""

    id: str
    state: str
    items: int
    counts: dict[str, int]
    verdicts: dict[str, int]
    labels: dict[str, str]


class Event(TypedDict):
    """Something that happened to a job."""

    event: str
    data: dict[str, Any]


class Client:
    """Speaks with a running service.

    ``key`` is sent where it is given, else that of the environment variable ``RETARGETD_KEY``. What may work later (a full queue, a
    connection that breaks) is tried again as the service asks for; what is refused is raised as :class:`Error`.

    ::

        client = rt.Client("http://127.0.0.1:8080")
        job = client.wait(client.submit("walk.fbx", "hero.glb", {"edit": {"fps": 30}}))
        client.download(job, "out.glb")
    """

    def __init__(self, url: str = "http://127.0.0.1:8080", key: str | None = None, *, timeout: float = 60.0) -> None:
        parts = urllib.parse.urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.netloc:
            raise ValueError(f"'{url}' is no address of a service, such as http://127.0.0.1:8080")
        self.url = url.rstrip("/")
        self.timeout = timeout
        self._key = key if key is not None else os.environ.get("RETARGETD_KEY")

    # Files.

    def upload(self, file: FileLike, name: str | None = None) -> str:
        """Uploads a file and gives its id; the same bytes again have the same id."""
        from .files import read

        given, data = read(file, "source")
        query = urllib.parse.urlencode({"filename": name or given or "upload"})
        headers = {"Content-Type": "application/octet-stream"}
        asset: Asset = json.loads(self._call("POST", f"/v1/assets?{query}", data, headers))
        return asset["id"]

    # Jobs.

    def submit(
        self,
        source: FileLike,
        target: FileLike | None = None,
        config: Mapping[str, object] | None = None,
        *,
        source_rest: FileLike | None = None,
        target_rest: FileLike | None = None,
        output: Sequence[str] = ("glb",),
        preset: str | None = None,
        labels: Mapping[str, str] | None = None,
        priority: int | None = None,
        idempotency_key: str | None = None,
    ) -> Job:
        """Asks for a job and gives it as it was taken on; it survives a restart of the service. Only an edit has no target. Files may be
        ids of assets."""
        files = {"source": source, "target": target, "source_rest": source_rest, "target_rest": target_rest}
        asked: dict[str, object] = {"output": [_format(name) for name in output]}
        for part, file in files.items():
            if file is not None:
                asked[part] = {"asset": self._asset(file)}
        said = {"config": config, "preset": preset, "labels": labels, "priority": priority}
        asked.update({name: value for name, value in said.items() if value is not None})
        # However often this has to be sent, there is one job.
        headers = {"Idempotency-Key": idempotency_key or str(uuid.uuid4())}
        job: Job = self._document("POST", "/v1/jobs", asked, headers)
        return job

    def job(self, job: Job | str, *, wait: float = 0) -> Job:
        """How a job is; the service holds the answer back for up to ``wait`` seconds while it has not ended."""
        headers = {"Prefer": f"wait={int(wait)}"} if wait >= 1 else {}
        found: Job = self._document("GET", f"/v1/jobs/{_id(job)}", None, headers)
        return found

    def wait(self, job: Job | str, *, timeout: float | None = None) -> Job:
        """Waits until a job has ended, and gives it; raises what it failed of, or :class:`TimeoutError`."""
        end = None if timeout is None else time.monotonic() + timeout
        while True:
            left = _WAIT_SECONDS if end is None else max(0.0, min(_WAIT_SECONDS, end - time.monotonic()))
            found = self.job(job, wait=left)
            if found["state"] in ENDED:
                break
            if end is not None and time.monotonic() >= end:
                raise TimeoutError(f"job {found['id']} is still {found['state']}")
            if left < 1:
                time.sleep(0.1)
        if found["state"] == "succeeded":
            return found
        raise _problem(found.get("problem") or {"code": found["state"], "detail": f"the job was {found['state']}"})

    def events(self, job: Job | str) -> Iterator[Event]:
        """What happens to a job until it ends: ``job.progress`` and its states. A stream that breaks is taken up where it was; where
        streams do not get through, the job is asked for every second."""
        last_id: str | None = None
        failures = 0
        while failures < 2:
            headers = {"Last-Event-ID": last_id} if last_id else {}
            try:
                with closing(self._open("GET", f"/v1/jobs/{_id(job)}/events", None, headers)) as stream:
                    if stream.status == 204:
                        return
                    for number, event in _parse_events(stream):
                        last_id, failures = number or last_id, 0
                        if event["event"] != "bye":
                            yield event
            except (OSError, http.client.HTTPException):
                failures += 1
            if self.job(job)["state"] in ENDED and failures == 0:
                return
            failures += 1
        yield from self._polled(job)

    def _polled(self, job: Job | str) -> Iterator[Event]:
        told: object = None
        while True:
            found = self.job(job)
            state = (found["state"], found.get("progress"))
            if state != told:
                told = state
                name = found["state"] if found["state"] != "running" else "progress"
                yield {"event": f"job.{name}", "data": dict(found)}
            if found["state"] in ENDED:
                return
            time.sleep(1)

    def cancel(self, job: Job | str) -> Job:
        """Stops a job."""
        found: Job = self._document("POST", f"/v1/jobs/{_id(job)}/cancel")
        return found

    def report(self, job: Job | str) -> dict[str, Any]:
        """The report of a job that has succeeded."""
        report: dict[str, Any] = self._document("GET", f"/v1/jobs/{_id(job)}/report")
        return report

    def download(self, job: Job | str, path: str | os.PathLike[str]) -> Path:
        """Writes the result of a job whose format has the ending of ``path``, else its first one, and checks that it arrived
        as it is."""
        from .results import write_whole

        place = Path(path)
        found = job if isinstance(job, dict) and job["results"] else self.job(job)
        if not found["results"]:
            raise Failed(f"job {found['id']} is {found['state']} and has no results", code="no_results")
        ending = place.suffix.lower()
        fits = (result for result in found["results"] if Path(result["file_name"]).suffix.lower() == ending)
        write_whole(place, self.content(next(fits, found["results"][0])))
        return place

    def content(self, result: ResultFile) -> bytes:
        """The bytes of a result."""
        data = self._call("GET", result["content"])
        if hashlib.sha256(data).hexdigest() != result["sha256"]:
            raise Failed("what arrived is not what the service holds", code="torn_download")
        return data

    def retarget(
        self, source: FileLike, target: FileLike, config: Mapping[str, object] | None = None, **options: Any
    ) -> bytes:
        """Asks, waits and downloads; gives the bytes of the first result."""
        return self.content(self.wait(self.submit(source, target, config, **options))["results"][0])

    def suggest(
        self, source: FileLike, target: FileLike, config: Mapping[str, object] | None = None
    ) -> dict[str, Any]:
        """What a retarget would do."""
        asked: dict[str, object] = {"source": {"asset": self._asset(source)}, "target": {"asset": self._asset(target)}}
        if config is not None:
            asked["config"] = config
        proposal: dict[str, Any] = self._document("POST", "/v1/mapping-suggestions", asked)
        return proposal

    def inspect(self, file: FileLike) -> dict[str, Any]:
        """What a file holds."""
        found: dict[str, Any] = self._document("GET", f"/v1/assets/{self._asset(file)}/skeleton")
        return found

    # Batches.

    def batch(
        self,
        sources: str | os.PathLike[str] | Sequence[FileLike],
        target: FileLike | list[FileLike],
        config: Mapping[str, object] | None = None,
        *,
        output: Sequence[str] = ("glb",),
        labels: Mapping[str, str] | None = None,
        idempotency_key: str | None = None,
    ) -> Batch:
        """Asks for every source onto every target. ``sources`` is a folder of clips or a list of files. One batch has at most 1,000
        jobs; more are several batches, which :func:`retargetd.bulk.service` makes."""
        clips = _clips(sources)
        targets: list[FileLike] = list(target) if isinstance(target, list) else [target]
        characters = [self._asset(one) for one in targets]
        items = [
            {
                "source": {"asset": self._asset(clip)},
                "target": {"asset": character},
                "labels": {"name": _stem(clip, index)},
            }
            for index, clip in enumerate(clips)
            for character in characters
        ]
        return self.batch_of(items, config, output=output, labels=labels, idempotency_key=idempotency_key)

    def batch_of(
        self,
        items: Sequence[Mapping[str, object]],
        config: Mapping[str, object] | None = None,
        *,
        output: Sequence[str] = ("glb",),
        labels: Mapping[str, str] | None = None,
        idempotency_key: str | None = None,
    ) -> Batch:
        """The same for items as ``POST /v1/batches`` takes them."""
        defaults: dict[str, object] = {"output": [_format(name) for name in output]}
        if config is not None:
            defaults["config"] = config
        asked = {"defaults": defaults, "items": list(items), "labels": dict(labels or {})}
        headers = {"Idempotency-Key": idempotency_key or str(uuid.uuid4())}
        batch: Batch = self._document("POST", "/v1/batches", asked, headers)
        return batch

    def wait_batch(self, batch: Batch | str, *, timeout: float | None = None) -> Batch:
        """Waits until all jobs of a batch have ended. That some failed is no exception: ``counts`` says it, :meth:`batch_jobs` why."""
        end = None if timeout is None else time.monotonic() + timeout
        while True:
            left = _WAIT_SECONDS if end is None else max(0.0, min(_WAIT_SECONDS, end - time.monotonic()))
            headers = {"Prefer": f"wait={int(left)}"} if left >= 1 else {}
            found: Batch = self._document("GET", f"/v1/batches/{_id(batch)}", None, headers)
            if found["state"] in ENDED:
                return found
            if end is not None and time.monotonic() >= end:
                raise TimeoutError(f"batch {found['id']} is still {found['state']}")
            if left < 1:
                time.sleep(0.1)

    def batch_jobs(self, batch: Batch | str, state: str | None = None) -> Iterator[Job]:
        """The jobs of a batch, page by page."""
        query = {"limit": "200", **({"state": state} if state else {})}
        while True:
            page = self._document("GET", f"/v1/batches/{_id(batch)}/jobs?{urllib.parse.urlencode(query)}")
            yield from page["items"]
            if not page.get("next_cursor"):
                return
            query["cursor"] = page["next_cursor"]

    # The wire.

    def _asset(self, file: FileLike) -> str:
        if isinstance(file, str) and file.startswith("ast_"):
            return file
        return self.upload(file)

    def _document(
        self, method: str, path: str, document: object = None, headers: Mapping[str, str] | None = None
    ) -> Any:
        body = None if document is None else json.dumps(document).encode()
        kind = {"Content-Type": "application/json"} if body is not None else {}
        return json.loads(self._call(method, path, body, {**kind, **(headers or {})}))

    def _call(
        self, method: str, path: str, body: bytes | None = None, headers: Mapping[str, str] | None = None
    ) -> bytes:
        with closing(self._open(method, path, body, headers)) as answer:
            return answer.read()

    def _open(
        self, method: str, path: str, body: bytes | None, headers: Mapping[str, str] | None
    ) -> http.client.HTTPResponse:
        """The open answer. What may work later is tried again, as long as the service asks for."""
        sent = {"User-Agent": "retargetd-python", **(headers or {})}
        if self._key:
            sent["Authorization"] = f"Bearer {self._key}"
        for attempt in range(_TRIES):
            pause = 2.0**attempt / 4
            request = urllib.request.Request(self.url + path, data=body, headers=sent, method=method)
            try:
                answer: http.client.HTTPResponse = urllib.request.urlopen(request, timeout=self.timeout)
                return answer
            except urllib.error.HTTPError as refused:
                with refused:
                    problem = _problem_of(refused)
                    pause = float(refused.headers.get("Retry-After") or pause)
                if not problem.get("retryable") or attempt == _TRIES - 1:
                    raise _problem(problem) from None
            except (urllib.error.URLError, ConnectionError, TimeoutError) as broken:
                if attempt == _TRIES - 1:
                    raise Failed(
                        f"the service at {self.url} does not answer: {broken}",
                        code="service_unreachable",
                        hint="start it with 'retargetd serve', or check the address",
                    ) from None
            time.sleep(min(pause, _LONGEST_PAUSE_SECONDS))
        raise AssertionError("the last try gives an answer or raises")


def _problem_of(refused: urllib.error.HTTPError) -> dict[str, Any]:
    try:
        problem = json.loads(refused.read())
        if isinstance(problem, dict):
            return problem
    except (ValueError, OSError):
        pass
    later = refused.code in (429, 502, 503, 504)
    return {"code": f"http_{refused.code}", "detail": str(refused.reason), "retryable": later}


def _problem(problem: Mapping[str, Any]) -> Error:
    code = str(problem.get("code", "internal"))
    fields = fields_of(problem.get("errors") or ())
    return class_of(code)(
        str(problem.get("detail", code)),
        code=code,
        part=str(problem.get("part") or ""),
        place=str(problem.get("place") or ""),
        hint=str(problem.get("hint") or ""),
        errors=fields,
    )


def _parse_events(stream: http.client.HTTPResponse) -> Iterator[tuple[str | None, Event]]:
    """Events of a stream, with their ids."""
    name, number = "message", None
    data: list[str] = []
    for raw in stream:
        line = raw.decode().rstrip("\r\n")
        if not line:
            if data:
                yield number, {"event": name, "data": json.loads("\n".join(data))}
            name, data = "message", []
            continue
        key, _, value = line.partition(":")
        value = value.removeprefix(" ")
        if key == "event":
            name = value
        elif key == "id":
            number = value
        elif key == "data":
            data.append(value)


def _format(name: str) -> str:
    """The name on the wire of what may be the ending of a file name."""
    return {"npz": "poses_npz", "json": "poses_json", "csv": "positions_csv"}.get(name.lstrip("."), name.lstrip("."))


def _id(thing: Mapping[str, Any] | str) -> str:
    return urllib.parse.quote(thing if isinstance(thing, str) else str(thing["id"]), safe="")


def _clips(sources: str | os.PathLike[str] | Sequence[FileLike]) -> list[FileLike]:
    if not isinstance(sources, (str, os.PathLike)):
        return list(sources)
    place = Path(sources)
    if not place.is_dir():
        return [place]
    clips: list[FileLike] = [path for path in sorted(place.iterdir()) if path.is_file() and path.name[0] != "."]
    if not clips:
        raise ValueError(f"the folder {place} has no clips")
    return clips


def _stem(clip: FileLike, index: int) -> str:
    if isinstance(clip, (str, os.PathLike)):
        return Path(clip).stem
    return f"{index:04}"
