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

from . import _host
from .client import Client
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
from .plan import Plan
from .poses import Poses
from .results import Measures, Picture, Result, Warned

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

_host.announce()
