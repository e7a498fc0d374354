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
