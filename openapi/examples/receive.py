#!/usr/bin/env python3
"""Receives what a webhook of retargetd is told, and checks who says it. Needs nothing but Python 3.9.

    RETARGETD_WEBHOOK_SECRET=whsec_... python3 receive.py [PORT]

Messages are signed by the Standard Webhooks scheme, for which there are libraries in most languages; this is all that they do. In
front of it stands whatever ends TLS for you.
"""

import base64
import hashlib
import hmac
import json
import os
import sys
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

SECRET = base64.b64decode(os.environ["RETARGETD_WEBHOOK_SECRET"].removeprefix("whsec_"))
# Older messages may have been caught on the way, and sent again by somebody else.
TOLERANCE_SECONDS = 300
MOST_BYTES = 1 << 20
# A real receiver keeps these where they survive a restart: every message comes at least once, and may come again.
seen = set()


def is_genuine(headers, body):
    """Whether one of the signatures is made with our secret, and the message is not from long ago."""
    message_id, timestamp = headers.get("webhook-id", ""), headers.get("webhook-timestamp", "")
    if not timestamp.isdigit() or abs(time.time() - int(timestamp)) > TOLERANCE_SECONDS:
        return False
    signed = f"{message_id}.{timestamp}.".encode() + body
    expected = base64.b64encode(hmac.new(SECRET, signed, hashlib.sha256).digest()).decode()
    given = headers.get("webhook-signature", "").split(" ")
    return any(hmac.compare_digest(f"v1,{expected}".encode(), signature.encode()) for signature in given)


class Receiver(BaseHTTPRequestHandler):
    def do_POST(self):
        length = int(self.headers.get("content-length", 0))
        body = self.rfile.read(min(length, MOST_BYTES))
        if not is_genuine(self.headers, body):
            return self.answer(401)
        # Answer soon, and work afterwards: who takes longer than 15 seconds is told again.
        self.answer(204)
        if self.headers["webhook-id"] not in seen:
            seen.add(self.headers["webhook-id"])
            message = json.loads(body)
            print(message["type"], json.dumps(message["data"]), flush=True)

    def answer(self, status):
        self.send_response(status)
        self.send_header("content-length", "0")
        self.end_headers()

    def log_message(self, *_):
        pass


if __name__ == "__main__":
    server = ThreadingHTTPServer(("127.0.0.1", int(sys.argv[1]) if len(sys.argv) > 1 else 8081), Receiver)
    print(f"listens on http://127.0.0.1:{server.server_port}", flush=True)
    server.serve_forever()
