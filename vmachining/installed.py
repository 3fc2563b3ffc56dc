"""Tables that other packages add to: our own entries, and what an entry-point group names.

A package names its entries in its `pyproject.toml`, see `docs/add_an_engine.md` and `docs/add_a_dialect.md`:

    [project.entry-points."vmachining.engines"]
    coarse = "vm_coarse:ENTRY"
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TypeVar

from vmachining.errors import InputError

T = TypeVar("T")


class Installed(Mapping[str, T]):
    """Own entries first, in their order; then those of installed packages, by name.

    Packages are looked for when a name is asked for that is not ours, or when the whole table is read.

    Raises InputError: A package takes a name of ours, two packages take the same name, or an entry does not load or is
        of another kind.
    """

    def __init__(self, group: str, kind: type[T], own: Mapping[str, T]) -> None:
        self.group, self.kind, self.own = group, kind, dict(own)

    @cached_property
    def _others(self) -> dict[str, T]:
        from importlib.metadata import entry_points

        found: dict[str, T] = {}
        for point in sorted(entry_points(group=self.group), key=lambda point: point.name):
            package = point.dist.name if point.dist else "an installed package"
            where = f"{package}: entry {point.name!r} of {self.group}"
            if point.name in self.own or point.name in found:
                raise InputError(f"{where}: this name is taken", remedy=f"rename it, or uninstall {package}")
            try:
                entry = point.load()
            except Exception as exc:  # a stranger's module may raise anything at its import
                raise InputError(
                    f"{where} does not load: {exc}", remedy=f"repair or uninstall {package}"
                ) from exc
            if not isinstance(entry, self.kind):
                what = f"{where} is {type(entry).__name__}, not {self.kind.__name__}"
                raise InputError(what, remedy=f"repair or uninstall {package}")
            found[point.name] = entry
        return found

    def __getitem__(self, name: str) -> T:
        return self.own[name] if name in self.own else self._others[name]

    def __iter__(self) -> Iterator[str]:
        yield from self.own
        yield from self._others

    def __len__(self) -> int:
        return len(self.own) + len(self._others)
