"""Cutters take their sizes by name; missing or misspelt names raise a ToolError."""

from __future__ import annotations

import dataclasses
from abc import ABCMeta
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from vmachining.errors import ToolError


class Named(ABCMeta):
    """Metaclass of dataclasses whose fields are given by name."""

    if not TYPE_CHECKING:  # the signature of the dataclass is the one to check calls against

        def __call__(cls, *args: Any, **given: Any) -> Any:
            _refuse(cls, args, given)
            return super().__call__(**given)


def _refuse(cls: Any, args: tuple[Any, ...], given: dict[str, Any]) -> None:
    """ToolError for values without names, unknown names, missing sizes, and values that are not numbers."""
    fields = {field.name: field for field in dataclasses.fields(cls) if field.init}
    required = [name for name, field in fields.items() if field.default is dataclasses.MISSING]
    required.sort(key=lambda name: name == "length")  # the sizes of the tip first
    name = cls.__name__
    if args:
        said = [f"{key}={value!r}" for key, value in zip(required, args, strict=False)]
        left = [f"{key}=..." for key in required[len(args) :] if key not in given]
        kept = [f"{key}={value!r}" for key, value in given.items()]
        raise ToolError(
            f"{name} takes its sizes by name", remedy=f"{name}({', '.join([*said, *kept, *left])}), in mm"
        )
    for key in given:
        if key not in fields:
            close = get_close_matches(key, fields, n=1, cutoff=0.4)
            remedy = f"did you mean {close[0]}?" if close else f"it has {', '.join(fields)}"
            raise ToolError(f"{name} has no {key}", word=key, remedy=remedy)
    if missing := [key for key in required if key not in given]:
        example = ", ".join(f"{key}={given[key]!r}" if key in given else f"{key}=..." for key in required)
        raise ToolError(
            f"{name} lacks {' and '.join(missing)}", word=missing[0], remedy=f"{name}({example}), in mm"
        )
    for key, value in given.items():
        number = "float" in str(fields[key].type)
        if value is None and "None" in str(fields[key].type):
            continue
        if number and (isinstance(value, str | bytes | bool) or not hasattr(value, "__float__")):
            raise ToolError(
                f"{name}: {key} = {value!r} is not a number", word=key, remedy="give it in mm or degrees"
            )
