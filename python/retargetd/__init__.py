"""Moves character animation from any rig to any rig, and measures what it did.

>>> import retargetd as rt
>>> walk, mannequin = rt.samples()
>>> out = rt.retarget(walk, mannequin)
>>> out.poses.rotations.shape
(121, 80, 4)
>>> out.verdict in ("pass", "warn")
True

Files are given as paths, as bytes, or as :class:`Poses`. What the engine refuses is raised as :class:`InputRefused`,
:class:`ConfigError` or :class:`Failed`, each with ``code``, ``pointer``, ``hint`` and ``place``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from . import _host
from .errors import ConfigError, Error, FieldError, Failed, InputRefused
from .files import File
from .functions import (
    check_config,
    compare,
    draw,
    edit,
    explain,
    formats,
    inspect,
    pose,
    presets,
    preview,
    retarget,
    rigs,
    samples,
    schema,
    suggest,
    tune,
    version,
)
from .results import Measures, Picture, Result, Warned

if TYPE_CHECKING:
    from .client import Client
    from .plan import Plan
    from .poses import Poses

__version__ = version()

__all__ = [
    "Client",
    "ConfigError",
    "Error",
    "Failed",
    "FieldError",
    "File",
    "InputRefused",
    "Measures",
    "Picture",
    "Plan",
    "Poses",
    "Result",
    "Warned",
    "__version__",
    "check_config",
    "compare",
    "draw",
    "edit",
    "explain",
    "formats",
    "inspect",
    "pose",
    "presets",
    "preview",
    "retarget",
    "rigs",
    "samples",
    "schema",
    "suggest",
    "tune",
    "version",
]

# NumPy and the modules of HTTP take longer to load than everything else, and not everybody needs them.
_LATER = {"Client": "client", "Plan": "plan", "Poses": "poses"}


def __getattr__(name: str) -> object:
    if name not in _LATER:
        raise AttributeError(f"module 'retargetd' has no attribute '{name}'")
    found = getattr(import_module(f".{_LATER[name]}", __name__), name)
    globals()[name] = found
    return found


_host.announce()
