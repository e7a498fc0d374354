"""What the engine refuses, as exceptions."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple


class FieldError(NamedTuple):
    """One thing that is wrong with a config."""

    pointer: str
    """JSON pointer into the config, such as ``/source/chains/left_leg/1``."""
    code: str
    detail: str
    did_you_mean: tuple[str, ...]


class Error(Exception):
    """Why there is no result.

    >>> import retargetd as rt
    >>> try:
    ...     rt.inspect(b"no model")
    ... except rt.Error as error:
    ...     print(error.code, error.part)
    unsupported_format source
    """

    def __init__(
        self,
        detail: str,
        *,
        code: str = "internal",
        part: str = "",
        place: str = "",
        hint: str = "",
        errors: tuple[FieldError, ...] = (),
    ) -> None:
        super().__init__(detail)
        self.detail = detail
        self.code = code
        """Stable; docs/reference/errors.md has them all."""
        self.part = part
        """Which input: ``source``, ``target``, ``source_rest``, ``target_rest``, ``config``. May be empty."""
        self.place = place
        """Where in that input. May be empty."""
        self.hint = hint
        """What you can do. May be empty."""
        self.errors = errors
        """Every single thing that is wrong with a config."""

    @property
    def pointer(self) -> str:
        """The JSON pointer of the first thing that is wrong with a config; empty where it is not about one."""
        return next((error.pointer for error in self.errors if error.pointer), "")

    def __str__(self) -> str:
        text = f"{self.part}: {self.detail}" if self.part else self.detail
        return f"{text} ({self.hint})" if self.hint else text

    def __reduce__(self) -> tuple[object, ...]:
        # Errors travel between the processes of a pool.
        facts = (self.code, self.part, self.place, self.hint, self.errors)
        return (_restored, (type(self), self.detail, *facts))


class InputRefused(Error):
    """A file cannot be used."""


class ConfigError(Error):
    """A config cannot be used."""


class Failed(Error):
    """The work failed for a reason that is not the input's."""


_ABOUT_CONFIGS = {
    "chain_not_connected",
    "invalid_value",
    "malformed_config",
    "unknown_field",
    "unknown_joint",
    "unknown_name",
}
_ABOUT_FILES = {
    "asset_limit_exceeded",
    "asset_malformed",
    "figure_not_found",
    "no_animation",
    "nothing_to_map",
    "skeleton_not_found",
    "strict_measures",
    "strict_warnings",
    "unsupported_feature",
    "unsupported_format",
}


def class_of(code: str) -> type[Error]:
    """The class of a code."""
    if code in _ABOUT_CONFIGS:
        return ConfigError
    return InputRefused if code in _ABOUT_FILES else Failed


def fields_of(errors: Iterable[Mapping[str, Any]]) -> tuple[FieldError, ...]:
    """The single things that are wrong, as the engine and the service write them."""
    return tuple(
        FieldError(
            str(error.get("pointer", "")),
            str(error.get("code", "")),
            str(error.get("detail", "")),
            tuple(error.get("did_you_mean", ())),
        )
        for error in errors
    )


def of_failure(code: str, detail: str, part: str, place: str, hint: str, errors: str) -> Error:
    """The exception of what the engine says; ``errors`` is JSON."""
    fields = fields_of(json.loads(errors))
    return class_of(code)(detail, code=code, part=part, place=place, hint=hint, errors=fields)


def _restored(
    kind: type[Error], detail: str, code: str, part: str, place: str, hint: str, errors: tuple[FieldError, ...]
) -> Error:
    return kind(detail, code=code, part=part, place=place, hint=hint, errors=errors)
