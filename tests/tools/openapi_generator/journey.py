"""What a user of a client does that OpenAPI Generator has made for Python: `python journey.py SOURCE TARGET FOLDER`.

The client lies in PYTHONPATH as `retargetd_client`; RETARGETD_URL says where the service is.
"""

import os
import sys
from pathlib import Path

from retargetd_client import (
    ApiClient,
    ApiException,
    AssetsApi,
    BatchesApi,
    Configuration,
    FormatName,
    JobsApi,
    JobState,
    NewBatch,
    NewJob,
    NewJobInput,
    ResultsApi,
    RetargetApi,
)

source, target, folder = (Path(argument) for argument in sys.argv[1:4])
client = ApiClient(Configuration(host=os.environ["RETARGETD_URL"]))
assets, jobs, batches = AssetsApi(client), JobsApi(client), BatchesApi(client)
ENDED = (JobState.SUCCEEDED, JobState.FAILED, JobState.CANCELED)


def upload(path: Path) -> NewJobInput:
    asset = assets.upload_asset(path.read_bytes(), filename=path.name)
    assert asset.file_name == path.name and asset.bytes == path.stat().st_size, asset
    return NewJobInput(asset=asset.id)


files = upload(source), upload(target)
print("uploaded two files")

# This generator asks for JSON wherever an answer may be JSON, which here is that of pose arrays.
parts = [(path.name, path.read_bytes()) for path in (source, target)]
made = RetargetApi(client).retarget(parts[0], parts[1], accept="model/gltf-binary")
(folder / "one_shot.glb").write_bytes(made)
print("retargeted in one request")

asked = NewJob(source=files[0], target=files[1], output=[FormatName.GLB])
job = jobs.create_job(asked, prefer="wait=20")
job = getattr(job, "actual_instance", job)
while job.state not in ENDED:
    job = jobs.show_job(job.id, prefer="wait=20")
assert job.state == JobState.SUCCEEDED and job.verdict and job.coverage, job
print(f"waited for a job: {job.verdict.value}")

(folder / "job.glb").write_bytes(ResultsApi(client).download_result(job.results[0].id))
print("downloaded its result")

body = NewBatch.from_dict({"defaults": {"target": files[1].to_dict()}, "items": [{"source": files[0].to_dict()}] * 2})
assert body is not None
batch = batches.create_batch(body)
batch = getattr(batch, "actual_instance", batch)
while batch.state not in ENDED:
    batch = batches.show_batch(batch.id, prefer="wait=20")
assert batch.counts.succeeded == 2, batch
assert len(jobs.list_jobs(state=JobState.SUCCEEDED).items) >= 3, "and lists them"
print("waited for a batch")

try:
    jobs.create_job(NewJob(source=NewJobInput(asset="ast_00000000000000000000000000"), target=files[1]))
    raise AssertionError("a job on nothing was taken")
except ApiException as error:
    assert error.status == 422 and "unknown_asset" in str(error.body), error
    print("was refused: unknown_asset")
