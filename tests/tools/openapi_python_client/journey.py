"""What a user of a client does that openapi-python-client has made: `python journey.py SOURCE TARGET FOLDER`.

The client lies in PYTHONPATH as `retargetd_client`; RETARGETD_URL says where the service is.
"""

import os
import sys
from io import BytesIO
from pathlib import Path

from retargetd_client import AuthenticatedClient
from retargetd_client.api.assets import upload_asset
from retargetd_client.api.batches import create_batch, show_batch
from retargetd_client.api.jobs import create_job, list_jobs, show_job
from retargetd_client.api.results import download_result
from retargetd_client.api.retarget import retarget
from retargetd_client.models import (
    Asset,
    Batch,
    FormatName,
    Job,
    JobPage,
    JobState,
    NewBatch,
    NewJob,
    NewJobInput,
    Problem,
    RetargetBody,
    Verdict,
)
from retargetd_client.types import File

source, target, folder = (Path(argument) for argument in sys.argv[1:4])
client = AuthenticatedClient(base_url=os.environ["RETARGETD_URL"], token=os.environ.get("RETARGETD_KEY", "none"))


def file(path: Path) -> File:
    return File(payload=BytesIO(path.read_bytes()), file_name=path.name)


def upload(path: Path) -> NewJobInput:
    asset = upload_asset.sync(client=client, body=file(path), filename=path.name)
    assert isinstance(asset, Asset), asset
    assert asset.file_name == path.name and asset.bytes_ == path.stat().st_size, asset
    return NewJobInput(asset=asset.id)


files = upload(source), upload(target)
print("uploaded two files")

made = retarget.sync(client=client, body=RetargetBody(source=file(source), target=file(target)))
assert isinstance(made, File), made
(folder / "one_shot.glb").write_bytes(made.payload.read())
print("retargeted in one request")

asked = NewJob(source=files[0], target=files[1], output=[FormatName.GLB])
job = create_job.sync(client=client, body=asked, prefer="wait=20")
while isinstance(job, Job) and job.state not in (JobState.SUCCEEDED, JobState.FAILED, JobState.CANCELED):
    job = show_job.sync(id=job.id, client=client, prefer="wait=20")
assert isinstance(job, Job) and job.state is JobState.SUCCEEDED, job
assert job.verdict in (Verdict.PASS, Verdict.WARN, Verdict.FAIL) and job.coverage, job
print(f"waited for a job: {job.verdict}")

content = download_result.sync(id=job.results[0].id, client=client)
assert isinstance(content, File), content
(folder / "job.glb").write_bytes(content.payload.read())
print("downloaded its result")

body = NewBatch.from_dict({"defaults": {"target": files[1].to_dict()}, "items": [{"source": files[0].to_dict()}] * 2})
batch = create_batch.sync(client=client, body=body)
while isinstance(batch, Batch) and batch.state not in (JobState.SUCCEEDED, JobState.FAILED, JobState.CANCELED):
    batch = show_batch.sync(id=batch.id, client=client, prefer="wait=20")
assert isinstance(batch, Batch) and batch.counts.succeeded == 2, batch
page = list_jobs.sync(client=client, state=JobState.SUCCEEDED)
assert isinstance(page, JobPage) and len(page.items) >= 3, page
print("waited for a batch")

missing = NewJobInput(asset="ast_00000000000000000000000000")
problem = create_job.sync(client=client, body=NewJob(source=missing, target=files[1]))
assert isinstance(problem, Problem) and problem.code == "unknown_asset" and problem.status == 422, problem
print(f"was refused: {problem.code}")
