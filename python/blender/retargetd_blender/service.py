# SPDX-License-Identifier: GPL-3.0-or-later
"""The service: asking it over HTTP, in a thread of its own, and starting it on this machine. Never touches Blender's data."""

import json
import os
import re
import subprocess
import tempfile
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid

ENDED = ("succeeded", "failed", "canceled")
WAIT_SECONDS = 5


class Refused(Exception):
    """The service refuses, or is not there; the text is for people."""


class Service:
    def __init__(self, url, key="", timeout=60.0):
        self.url = url.rstrip("/")
        self._key = key
        self._timeout = timeout

    def retarget(self, files, config, is_canceled, tell=lambda text: None):
        """Asks for a job, waits for it, and gives the arrays of its result and its report. `files` are (part, name, bytes)."""
        job = self._json("POST", "/v1/jobs", *form(files, config), {"Idempotency-Key": str(uuid.uuid4())})
        path = f"/v1/jobs/{urllib.parse.quote(job['id'])}"
        while job["state"] not in ENDED:
            if is_canceled():
                self._json("POST", path + "/cancel")
                raise Refused("canceled")
            progress = job.get("progress")
            place = job.get("queue_position")
            tell(f"{progress['phase']} {progress['done']}/{progress['total']}" if progress else f"waits as number {place or 1}")
            job = self._json("GET", path, headers={"Prefer": f"wait={WAIT_SECONDS if not is_canceled() else 0}"})
        if job["state"] != "succeeded":
            raise Refused(words_of(job.get("problem") or {"detail": f"the job was {job['state']}"}))
        data = self._bytes("GET", job["results"][0]["content"])
        return data, self._json("GET", path + "/report")

    def suggest(self, files, config):
        """What a retarget of two files would do."""
        return self._json("POST", "/v1/mapping-suggestions", *form(files, config))

    def presets(self):
        return [preset["name"] for preset in self._json("GET", "/v1/presets")["items"]]

    def put_rig(self, name, template):
        body = json.dumps(template).encode()
        self._json("PUT", f"/v1/rigs/{urllib.parse.quote(name)}", body, "application/json")

    def is_ready(self):
        try:
            self._bytes("GET", "/readyz", timeout=2)
        except Refused:
            return False
        return True

    def _json(self, method, path, body=None, kind=None, headers=None):
        data = self._bytes(method, path, body, kind, headers)
        return json.loads(data) if data else {}

    def _bytes(self, method, path, body=None, kind=None, headers=None, timeout=None):
        sent = {**(headers or {}), **({"Content-Type": kind} if kind else {})}
        if self._key:
            sent["Authorization"] = f"Bearer {self._key}"
        request = urllib.request.Request(self.url + path, data=body, headers=sent, method=method)
        try:
            with urllib.request.urlopen(request, timeout=timeout or self._timeout) as answer:
                return answer.read()
        except urllib.error.HTTPError as refused:
            with refused:
                content = refused.read()
            try:
                problem = json.loads(content)
            except ValueError:
                problem = {"detail": f"the service answers {refused.code}"}
            raise Refused(words_of(problem)) from None
        except OSError as broken:
            reason = getattr(broken, "reason", broken)
            raise Refused(f"The service at {self.url} does not answer ({reason}). Start it, or set its address in the preferences.") from None


def words_of(problem):
    hint = f" Hint: {problem['hint']}" if problem.get("hint") else ""
    return f"{problem.get('part', '')}: {problem.get('detail', '')}.{hint}".lstrip(": ")


def form(files, config):
    """A multipart form, and its media type."""
    boundary = uuid.uuid4().hex
    parts = [*files]
    if config is not None:
        parts.append(("config", "config.json", json.dumps(config).encode()))
    room = bytearray()
    for part, name, data in parts:
        plain = name.replace('"', "_").replace("\r", "_").replace("\n", "_")
        room += f'--{boundary}\r\nContent-Disposition: form-data; name="{part}"; filename="{plain}"\r\n'.encode()
        room += b"Content-Type: application/octet-stream\r\n\r\n" + data + b"\r\n"
    room += f"--{boundary}--\r\n".encode()
    return bytes(room), f"multipart/form-data; boundary={boundary}"


class OwnService:
    """A service that runs as long as Blender does, on a free port of this machine."""

    def __init__(self):
        self._process = None
        self._folder = None
        self.url = ""

    def start(self, program, seconds=30.0):
        if self._process is not None and self._process.poll() is None:
            return self.url
        self._folder = tempfile.TemporaryDirectory(prefix="retargetd-", ignore_cleanup_errors=True)
        log = os.path.join(self._folder.name, "log")
        data = os.path.join(self._folder.name, "data")
        with open(log, "wb") as told:
            try:
                self._process = subprocess.Popen(
                    [program, "serve", "--listen", "127.0.0.1:0", "--data", data], stdout=told, stderr=told, stdin=subprocess.DEVNULL
                )
            except OSError as error:
                raise Refused(f"'{program}' cannot be started: {error}") from None
        end = time.monotonic() + seconds
        while time.monotonic() < end and self._process.poll() is None:
            with open(log, errors="replace") as file:
                found = re.search(r"127\.0\.0\.1:([1-9]\d*)", file.read())
            if found:
                self.url = f"http://127.0.0.1:{found[1]}"
                return self.url
            time.sleep(0.05)
        with open(log, errors="replace") as file:
            last = file.read()[-300:]
        self.stop()
        raise Refused(f"'{program} serve' does not start: {last.strip()}")

    def stop(self):
        if self._process is not None:
            self._process.terminate()
            try:
                self._process.wait(10)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
            self._process = None
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None
        self.url = ""


class Task:
    """One question in a thread; `poll` gives its outcome once it is there."""

    def __init__(self, work):
        self.told = ""
        self.error = None
        self.result = None
        self._canceled = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(work,), daemon=True)
        self._thread.start()

    def _run(self, work):
        try:
            self.result = work(self._canceled.is_set, self._tell)
        except Refused as refused:
            self.error = str(refused)
        except Exception as error:  # whatever it is, it is shown, and Blender goes on
            self.error = f"{type(error).__name__}: {error}"

    def _tell(self, text):
        self.told = text

    def cancel(self):
        self._canceled.set()

    def is_done(self):
        return not self._thread.is_alive()
