#!/usr/bin/env python3
"""Retargets a clip with a running retargetd: upload, ask, follow, download. Needs nothing but Python 3.9.

    python3 retarget.py walk.glb mannequin.glb out.glb

The service is at RETARGETD_URL (default http://127.0.0.1:8080); RETARGETD_KEY is sent where it is set.
"""

import hashlib
import http.client
import json
import os
import sys
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid

SERVICE = os.environ.get("RETARGETD_URL", "http://127.0.0.1:8080").rstrip("/")
KEY = os.environ.get("RETARGETD_KEY")
ENDED = ("succeeded", "failed", "canceled")
# Longer than the heartbeat of a stream of events.
TIMEOUT_SECONDS = 60
TRIES = 8


class Problem(Exception):
    """The service refuses; `document` is its problem (RFC 9457)."""

    def __init__(self, document):
        super().__init__(f"{document.get('code')}: {document.get('detail')}")
        self.document = document


def call(method, path, body=None, headers=None):
    """Sends a request and gives the open answer. What may work later is tried again, as long as the service asks for."""
    headers = dict(headers or {})
    if KEY:
        headers["Authorization"] = f"Bearer {KEY}"
    for attempt in range(TRIES):
        request = urllib.request.Request(SERVICE + path, data=body, headers=headers, method=method)
        try:
            return urllib.request.urlopen(request, timeout=TIMEOUT_SECONDS)
        except urllib.error.HTTPError as error:
            try:
                problem = json.load(error)
            except ValueError:
                problem = {"code": error.code, "detail": error.reason, "retryable": error.code in (502, 503, 504)}
            if not problem.get("retryable") or attempt == TRIES - 1:
                raise Problem(problem) from None
            pause = float(error.headers.get("Retry-After", 2**attempt / 4))
        except (urllib.error.URLError, ConnectionError, TimeoutError):
            if attempt == TRIES - 1:
                raise
            pause = 2**attempt / 4
        time.sleep(pause)


def call_json(method, path, document=None, headers=None):
    body = None if document is None else json.dumps(document).encode()
    headers = {"Content-Type": "application/json", **(headers or {})}
    with call(method, path, body, headers) as answer:
        return json.load(answer)


def upload(path):
    """Uploads a file; gives its id. The same bytes again give the same id."""
    with open(path, "rb") as file:
        content = file.read()
    name = urllib.parse.quote(os.path.basename(path))
    headers = {"Content-Type": "application/octet-stream"}
    with call("POST", f"/v1/assets?filename={name}", content, headers) as answer:
        return json.load(answer)["id"]


def events(job):
    """What happens to a job, as (event, data), until it ends. A stream that breaks is taken up where it was."""
    last_id = None
    while True:
        headers = {"Last-Event-ID": last_id} if last_id else {}
        with call("GET", f"/v1/jobs/{job}/events", headers=headers) as stream:
            if stream.status == 204:
                return
            event = None
            try:
                for line in stream:
                    field, _, value = line.decode().rstrip("\n").partition(": ")
                    if field == "id":
                        last_id = value
                    elif field == "event":
                        event = value
                    elif field == "data":
                        yield event, json.loads(value)
            except (ConnectionError, TimeoutError, http.client.HTTPException):
                pass
        if call_json("GET", f"/v1/jobs/{job}")["state"] in ENDED:
            return
        time.sleep(1)


def retarget(source, target, output, config=None):
    """Puts the animation of one file onto the character of another; writes the result and gives the job."""
    asked = {"source": {"asset": upload(source)}, "target": {"asset": upload(target)}, "output": ["glb"]}
    if config is not None:
        asked["config"] = config
    # However often this has to be sent, there is one job.
    job = call_json("POST", "/v1/jobs", asked, {"Idempotency-Key": str(uuid.uuid4())})
    for event, data in events(job["id"]):
        if event == "job.progress":
            progress = data["progress"]
            print(f"{progress['phase']} {progress['done']}/{progress['total']}", file=sys.stderr)
        else:
            print(event, file=sys.stderr)
    job = call_json("GET", f"/v1/jobs/{job['id']}")
    if job["state"] != "succeeded":
        raise Problem(job.get("problem", {"code": job["state"], "detail": "the job did not succeed"}))
    result = job["results"][0]
    with call("GET", result["content"]) as answer:
        content = answer.read()
    if hashlib.sha256(content).hexdigest() != result["sha256"]:
        raise RuntimeError("what arrived is not what the service holds")
    with open(output, "wb") as file:
        file.write(content)
    return job


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    try:
        done = retarget(*sys.argv[1:])
    except Problem as problem:
        sys.exit(f"{problem}\n{json.dumps(problem.document.get('errors', []), indent=2)}")
    print(f"wrote {sys.argv[3]}: job {done['id']}, {done['warnings_count']} warnings")
