"""Writes `retargetd/config.py`, the types of a config, from the JSON Schema that the engine gives."""

from __future__ import annotations

import keyword
import textwrap
from typing import Any

HEAD = '''"""The types of a config, made from its JSON Schema: `RETARGETD_UPDATE=1 python -m pytest python/tests -k config_types` writes them.

A checker then knows every field of a config that is written as a dictionary::

    spec: config.RetargetSpec = {"edit": {"fps": 30}, "ops": [{"op": "pelvis"}, {"op": "fk"}]}
"""

from __future__ import annotations

from typing import Any, Literal, TypedDict, Union

'''


def module(schema: dict[str, Any]) -> str:
    """The text of the module."""
    names = {name: schema["$defs"][name] for name in sorted(schema["$defs"])}
    made: list[str] = []
    exported: list[str] = []
    aliases: list[str] = []
    for name, definition in names.items():
        if "properties" in definition:
            made.append(typed_dict(name, definition))
        elif name == "Op":
            variants = []
            for variant in definition["oneOf"]:
                op = variant["properties"]["op"]["const"]
                own = "".join(word.title() for word in op.split("_")) + "Fields"
                variants.append(own)
                made.append(typed_dict(own, variant))
            exported += variants
            aliases.append(alias(name, "Union[" + ", ".join(f'"{variant}"' for variant in variants) + "]"))
        else:
            aliases.append(alias(name, type_of(definition, quoted=True)))
        exported.append(name)
    made.append(typed_dict("RetargetSpec", schema))
    exported.append("RetargetSpec")
    listed = "\n".join(f'    "{name}",' for name in sorted(exported))
    return HEAD + f"__all__ = [\n{listed}\n]\n\n" + "\n".join(aliases) + "\n\n\n" + "\n\n\n".join(made) + "\n"


def alias(name: str, text: str) -> str:
    return f"{name} = {text}"


def typed_dict(name: str, definition: dict[str, Any]) -> str:
    """One object, every field optional unless the schema says otherwise."""
    doc = sentence(definition.get("description", ""))
    fields = definition.get("properties", {})
    if any(keyword.iskeyword(field) for field in fields):
        rows = "\n".join(f"        {field!r}: {type_of(value)!r}," for field, value in fields.items())
        return f'{name} = TypedDict(\n    "{name}",\n    {{\n{rows}\n    }},\n    total=False,\n)'
    rows = "\n".join(f"    {field}: {type_of(value)}" for field, value in fields.items()) or "    pass"
    return f'class {name}(TypedDict, total=False):\n    """{doc}"""\n\n{rows}'


def sentence(text: str) -> str:
    plain = " ".join(text.split()).replace("\\", "").replace('"', "'")
    first = plain.split(". ")[0].rstrip(".") or "Fields"
    return textwrap.shorten(first, 100, placeholder="...") + "."


def type_of(value: dict[str, Any] | bool, quoted: bool = False) -> str:
    """The type of a value; references are quoted where they are evaluated."""
    if isinstance(value, bool):
        return "Any"
    if "$ref" in value:
        name = value["$ref"].rsplit("/", 1)[-1]
        return f'"{name}"' if quoted else name
    if "const" in value:
        return f"Literal[{value['const']!r}]".replace("'", '"')
    if "enum" in value:
        return "Literal[" + ", ".join(f'"{word}"' if isinstance(word, str) else repr(word) for word in value["enum"]) + "]"
    for several in ("oneOf", "anyOf"):
        if several in value:
            return union([type_of(one, quoted) for one in value[several]])
    kinds = value.get("type", "any")
    return union([plain_type(kind, value, quoted) for kind in (kinds if isinstance(kinds, list) else [kinds])])


def union(types: list[str]) -> str:
    distinct = list(dict.fromkeys(types))
    words = [one[8:-1] for one in distinct if one.startswith("Literal[")]
    others = [one for one in distinct if not one.startswith("Literal[")]
    merged = ([f"Literal[{', '.join(words)}]"] if words else []) + others
    return merged[0] if len(merged) == 1 else f"Union[{', '.join(merged)}]"


def plain_type(kind: str, value: dict[str, Any], quoted: bool) -> str:
    if kind == "array":
        items = value.get("items")
        return f"list[{type_of(items, quoted) if items is not None else 'Any'}]"
    if kind == "object":
        inner = value.get("additionalProperties")
        return f"dict[str, {type_of(inner, quoted) if isinstance(inner, dict) else 'Any'}]"
    return {"string": "str", "number": "float", "integer": "int", "boolean": "bool", "null": "None"}.get(kind, "Any")
