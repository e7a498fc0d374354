"""How engine processes are started when a Python interpreter is the host."""

from __future__ import annotations

import sys

from . import _engine

# Without site-packages and NumPy: a process that decodes what nobody trusts needs neither, and is there sooner.
_PROCESS = """
import sys, importlib.machinery, importlib.util
path = sys.argv.pop(1)
loader = importlib.machinery.ExtensionFileLoader("_engine", path)
module = importlib.util.module_from_spec(importlib.util.spec_from_loader("_engine", loader))
loader.exec_module(module)
sys.exit(module.run_command(["retargetd", *sys.argv[1:]]))
"""


def announce() -> None:
    """Has the engine's own processes be of this interpreter."""
    if sys.executable and _engine.__file__:
        _engine.engine_processes_are(sys.executable, ["-I", "-S", "-c", _PROCESS, _engine.__file__])
