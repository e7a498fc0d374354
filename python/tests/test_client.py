"""The client against the real service."""

from __future__ import annotations

import hashlib
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
import retargetd as rt


@pytest.fixture(scope="module")
def client(service: str) -> rt.Client:
    return rt.Client(service)


def test_a_job_from_files_to_download(client: rt.Client, files: tuple[Path, Path], tmp_path: Path) -> None:
    job = client.submit(*files, {"edit": {"fps": 30}}, output=["glb", "poses_npz"], labels={"shot": "012"})
    assert job["labels"] == {"shot": "012"}
    done = client.wait(job, timeout=120)
    assert done["state"] == "succeeded" and done["verdict"] in ("pass", "warn")
    client.download(done, tmp_path / "out.npz")
    client.download(job, tmp_path / "out.glb")
    here = rt.retarget(*files, {"edit": {"fps": 30}}, formats=["glb", "npz"])
    assert (tmp_path / "out.npz").read_bytes() == here.to_bytes("npz")
    assert (tmp_path / "out.glb").read_bytes() == here.data
    assert client.report(job)["counts"]["frames"] == 121
    assert not [path for path in tmp_path.iterdir() if path.suffix == ".part"]


def test_events_until_the_end(client: rt.Client, walk: bytes, mannequin: bytes) -> None:
    job = client.submit(walk, mannequin, {"align": "off"})
    told = [event["event"] for event in client.events(job)]
    assert told[-1] == "job.succeeded", told
    polled = [event["event"] for event in client._polled(job)]
    assert polled == ["job.succeeded"]


def test_a_job_that_fails_raises_what_it_failed_of(client: rt.Client, walk: bytes, mannequin: bytes) -> None:
    with pytest.raises(rt.ConfigError) as refused:
        client.wait(client.submit(walk, mannequin, {"algin": "off"}), timeout=60)
    assert refused.value.code == "unknown_field" and refused.value.pointer.endswith("/algin")
    with pytest.raises(rt.InputRefused) as refused_file:
        client.wait(client.submit(mannequin, walk), timeout=60)
    assert refused_file.value.code == "no_animation"
    with pytest.raises(rt.Error) as unknown:
        client.job("job_01j9z3k8m0q4r6t8v0x2y4a6c8")
    assert unknown.value.code


def test_the_same_key_is_the_same_job(client: rt.Client, walk: bytes, mannequin: bytes) -> None:
    word = hashlib.sha256(b"once").hexdigest()
    first = client.submit(walk, mannequin, idempotency_key=word)
    assert client.submit(walk, mannequin, idempotency_key=word)["id"] == first["id"]


def test_a_batch_of_a_folder(client: rt.Client, files: tuple[Path, Path], tmp_path: Path) -> None:
    for name in ("monday", "tuesday"):
        (tmp_path / f"{name}.glb").write_bytes(files[0].read_bytes())
    batch = client.wait_batch(client.batch(tmp_path, files[1], output=["glb"]), timeout=120)
    assert (batch["items"], batch["counts"]["succeeded"]) == (2, 2)
    jobs = list(client.batch_jobs(batch))
    assert {job["labels"]["name"] for job in jobs} == {"monday", "tuesday"}
    with pytest.raises(ValueError, match="no clips"):
        (tmp_path / "empty").mkdir()
        client.batch(tmp_path / "empty", files[1])


def test_questions(client: rt.Client, walk: bytes, mannequin: bytes) -> None:
    assert client.suggest(walk, mannequin)["counts"]["driven_joints"] > 10
    assert client.inspect(mannequin)["counts"]["joints"] > 10
    assert client.retarget(walk, mannequin)[:4] == b"glTF"


def test_a_service_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("retargetd.client._TRIES", 2)
    with pytest.raises(rt.Failed) as failed:
        rt.Client("http://127.0.0.1:9", timeout=2).job("job_x")
    assert failed.value.code == "service_unreachable" and "retargetd serve" in failed.value.hint
    with pytest.raises(ValueError, match="no address"):
        rt.Client("127.0.0.1:8080")


def test_what_may_work_later_is_tried_again(tmp_path: Path) -> None:
    asked = []

    class Answers(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.headers["Authorization"])
            is_second = len(asked) > 1
            body = b'{"id": "job_1", "state": "running"}' if is_second else b'{"code": "queue_full", "retryable": true}'
            self.send_response(200 if is_second else 429)
            self.send_header("Retry-After", "0.05")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Answers) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            client = rt.Client(f"http://127.0.0.1:{server.server_port}", key="secret")
            assert client.job("job_1")["state"] == "running"
        finally:
            server.shutdown()
            thread.join()
    assert asked == ["Bearer secret"] * 2
