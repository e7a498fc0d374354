"""What Schemathesis cannot guess: files that are files.

Without these, every upload is refused for its format, and nothing behind the upload is ever reached. Half of the files are clips; the
others are what it makes up by itself.
"""

import schemathesis
from hypothesis import strategies

CLIP = b"""HIERARCHY
ROOT Hips
{
 OFFSET 0 0 0
 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
 JOINT Spine
 {
  OFFSET 0 10 0
  CHANNELS 3 Zrotation Xrotation Yrotation
  End Site
  {
   OFFSET 0 10 0
  }
 }
}
MOTION
Frames: 2
Frame Time: 0.0333333
0 90 0 0 0 0 0 0 0
0 91 0 0 5 0 0 0 5
"""

files = strategies.just(CLIP) | strategies.binary(max_size=64)
schemathesis.openapi.media_type("application/octet-stream", files)

FILES = ("source", "target", "source_rest", "target_rest")


@schemathesis.hook
def map_body(context, body):
    """Gives the parts of forms that are files a clip, where the form has them."""
    if not isinstance(body, dict):
        return body
    given = {part: CLIP for part in FILES if isinstance(body.get(part), (str, bytes))}
    return {**body, **given}


# What a caller who keeps to the document can still be refused for: which files, ids and presets exist is not in it. Everything else, a
# field, a type, a range or a word that the document has and the service does not take, is a fault of one of the two.
RULES_OF_THE_DOCUMENT = {"malformed_request", "unknown_field", "unknown_part", "repeated_part", "unsupported_media_type"}


@schemathesis.check
def what_the_document_allows_is_taken(ctx, response, case):
    """A request that fits the document is not refused for its form."""
    meta = case.meta
    if meta is None or not meta.generation.mode.is_positive or response.status_code not in (400, 415, 422):
        return None
    problem = response.json()
    detail = problem.get("detail", "")
    pointers = [error.get("pointer", "") for error in problem.get("errors", [])]
    # Cursors are made by the service; the ops of a config, the items of a batch, presets and rig templates are left open in the document (they
    # have schemas of their own), and so is the second form of a job. That a drawing is one part or three, and not both, is said in words only.
    # Of patterns of headers and of the size of a picture, the tester knows little.
    is_left_open = (
        "cursor" in detail
        or "'If-" in detail
        or detail.startswith("the query cannot be used: ")
        or any(pointer.startswith(("/ops", "/items", "/config/ops")) for pointer in pointers)
        or case.operation.path in ("/v1/presets/{name}", "/v1/rigs/{name}")
        or (case.operation.path == "/v1/drawings" and "'drawing' was sent" in detail)
        or (case.operation.path == "/v1/jobs" and (problem.get("code") == "unknown_part" or "multipart" in detail))
    )
    if problem.get("code") in RULES_OF_THE_DOCUMENT and not is_left_open:
        raise AssertionError(f"it fits the document and is refused: {problem.get('code')}: {problem.get('detail')}")
    return None
