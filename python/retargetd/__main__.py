"""The ``retargetd`` command: the service, and everything that it does without one."""

from __future__ import annotations

import signal
import sys

from . import _engine, _host


def main() -> int:
    """Runs the command line of this process; gives the exit code."""
    # Python's own handler would only take note of Ctrl-C; the command has one of its own where there is something to tidy.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    _host.announce()
    return _engine.run_command(["retargetd", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
