"""Checks the messages on standard input, a JSON list of {"headers", "body"}, with the library of Standard Webhooks.

    python3 verify.py SECRET < messages.json

Exits with 0 when every one of them is signed with that secret.
"""

import json
import sys

from standardwebhooks import Webhook

webhook = Webhook(sys.argv[1])
for message in json.load(sys.stdin):
    webhook.verify(message["body"], message["headers"])
