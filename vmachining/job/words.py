"""What pydantic found in a job file, said in the words of a job file: what came, what is expected, where it belongs."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from vmachining.errors import JobError
from vmachining.force import shipped
from vmachining.job.model import JobFile, Keys, meanings
from vmachining.tomlplaces import KeyPath, dotted, nearest

MEANT: dict[tuple[str, ...], str] = {
    **{("stock", "cylinder", key): "give radius, half of it" for key in ("diameter", "diameter_mm")},
    **{
        ("stock", "cylinder", key): "give z = [lowest, highest]"
        for key in ("height", "length", "z_min", "z_max")
    },
    **{
        ("stock", "box", key): "give max, the opposite corner"
        for key in ("size", "length", "width", "height")
    },
    **{("stock", "box", key): "give min, the lowest corner" for key in ("origin", "corner", "center")},
    ("stock", "file"): 'give stl = "..." or step = "..."',
}
"""What people write and what they mean."""

Refuse = Callable[..., JobError]
"""(message, path of the key, remedy) -> error with file, line and column."""


def first_refusal(exc: ValidationError, refuse: Refuse) -> JobError:
    """The first finding as an error; a misspelt key goes before the key it leaves missing."""
    errors = sorted(exc.errors(), key=lambda e: e["type"] != "extra_forbidden")
    error, path = errors[0], _path(errors[0])
    same = [e for e in errors if _path(e) == path]  # the branches of a union complain one by one
    others = len({_path(e) for e in errors}) - 1
    more = f" ({others} more after this one)" if others else ""
    return refuse(_words(error, path, same) + more, path, _remedy(error, path, same))


def _path(error: ErrorDetails) -> KeyPath:
    """Location of an error without the union branches that pydantic adds."""
    return tuple(
        part for part in error["loc"]
        if not (isinstance(part, str) and (part.startswith(("constrained-", "literal[")) or part in ("float", "tuple")))
    )  # fmt: skip


def _words(error: ErrorDetails, path: KeyPath, same: list[ErrorDetails]) -> str:
    kind, name = error["type"], dotted(path)
    if kind == "extra_forbidden":
        where = f"under [{dotted(path[:-1])}]" if len(path) > 1 else "at the top level"
        return f"unknown key {path[-1]!r} {where}"
    if kind == "missing":
        if path and isinstance(path[-1], int):
            number = "number" if path[-1] == 1 else "numbers"
            return f"{dotted(path[:-1])} has only {path[-1]} {number}"
        return f"{name} is missing"
    if kind == "value_error":
        return str(error.get("ctx", {}).get("error", error["msg"]))
    value = error.get("input")
    shown = f" = {value!r}" if isinstance(value, str | int | float | bool | list) else ""
    return f"{name}{shown}: " + " or ".join(dict.fromkeys(_expected(e, path) for e in same))


def _expected(error: ErrorDetails, path: KeyPath) -> str:
    kind, most = error["type"], error.get("ctx", {}).get("max_length")
    said = {
        "model_type": "must be a table of keys", "dict_type": "must be a table of keys", "string_too_short": "must not be empty",
        "too_long": f"has more than {most} values", "tuple_type": "must be a list in brackets",
        "list_type": "must be an array of tables" if path == ("tools",) else "must be a list in brackets",
    }  # fmt: skip
    if kind in said:
        return said[kind]
    return re.sub(r"^(Input|String|List|Tuple) should (be|have)", r"must \2", error["msg"])


def _remedy(error: ErrorDetails, path: KeyPath, same: list[ErrorDetails]) -> str | None:
    kind = error["type"]
    if kind == "missing":
        if path and isinstance(path[-1], int):
            return _example(path[:-1]) or f"give {dotted(path[:-1])} all its numbers"
        if path == ("tools",):
            return "add a [[tools]] table"
        if path == ("force", "coefficients"):
            sets = " or ".join(f'"{name}"' for name in shipped())
            return f"add coefficients = {sets}, which are shipped, or a file of your own"
        return f"add a [{path[0]}] table" if len(path) == 1 else f"add {path[-1]} = ..."
    if kind == "extra_forbidden":
        return _place(path)
    if kind == "list_type" and path == ("tools",):
        return "write [[tools]] in two brackets, once per tool"
    if kind in ("tuple_type", "too_long"):
        return _example(path)
    if kind in ("model_type", "dict_type") and (known := _known_keys(path)):
        return f"its keys: {', '.join(known)}"
    if kind == "literal_error":
        options = re.findall(r"'([^']*)'", str(error.get("ctx", {}).get("expected", "")))
        close = nearest(str(error.get("input")), options)
        return f"did you mean {close!r}?" if close else f"take {' or '.join(map(repr, options))}"
    return None


def _place(path: KeyPath) -> str | None:
    """Where an unknown key may have been meant to stand."""
    known, key = _known_keys(path[:-1]), str(path[-1])
    if meant := MEANT.get((*(part for part in path[:-1] if isinstance(part, str)), key)):
        return meant
    if close := nearest(key, known):
        return f"did you mean {close!r}?"
    if sections := [name for name in JobFile.model_fields if key in _known_keys((name,))]:
        return f"it belongs under {' or '.join(f'[{name}]' for name in sections)}"
    return f"known here: {', '.join(known)}" if known else None


def _example(path: KeyPath) -> str | None:
    """How a key is written, with what its numbers mean."""
    *table, key = (part for part in path if isinstance(part, str))
    model = _table(table)
    info = None if model is None else model.model_fields.get(key)
    if model is None or info is None or not info.examples:
        return None
    return f"{key} = {info.examples[0]!s}: {meanings(model)[key]}"


def _known_keys(path: KeyPath) -> list[str]:
    """Keys that the model allows at a place, for suggestions."""
    model = _table(path)
    return list(model.model_fields) if model is not None else []


def _table(path: Iterable[str | int]) -> type[Keys] | None:
    """The model of a table; None where no table is."""
    model: type[Keys] | None = JobFile
    for part in path:
        if model is None or isinstance(part, int):
            continue
        info = model.model_fields.get(part)
        options = [] if info is None else [info.annotation, *getattr(info.annotation, "__args__", ())]
        model = next((one for one in options if isinstance(one, type) and issubclass(one, Keys)), None)
    return model
