"""The same work over a table: rows of (source, target, config) in, results in a folder and a table of verdicts out.

Three engines do it: a pool of processes, `Ray Data <https://docs.ray.io/en/latest/data/data.html>`_ and
`Dask <https://distributed.dask.org>`_. All leave the same files:

- ``results/<name>.<ending>``: what each row gave,
- ``records/<key>.json``: what became of each row, written when it is done, so that a run which is stopped (or whose worker dies) goes on
  where it was, and the same table a second time does nothing,
- ``table.parquet`` (``table.csv`` without pyarrow): one line a row, those that failed with their problem.

::

    from retargetd import bulk

    rows = bulk.read_table("rows.csv")                    # columns source, target, config, name
    summary = bulk.run(rows, "out", workers=8)
    summary = bulk.run(rows, "s3://bucket/out", engine="ray")
"""

from .engines import run
from .rows import Row, read_table
from .service import service
from .tables import Summary, collect

__all__ = ["Row", "Summary", "collect", "read_table", "run", "service"]
