"""A milling machine as a whole: its chain, the keys of [machine], its legs; from a preset, a machine file or a job."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from vmachining.errors import JobError, KinematicsError
from vmachining.job.model import Machine as MachineKeys
from vmachining.machine import Hexapod, Machine, MachineLimits, load, preset, read_parts


@dataclass(frozen=True, slots=True, eq=False)
class Mill:
    """chain : None for three slides. keys : of [machine], those of a machine file included. legs : of a hexapod head."""

    name: str
    chain: Machine | None
    keys: MachineKeys
    legs: Hexapod | None = None

    @property
    def limits(self) -> MachineLimits:
        return limits_of(self.keys)

    @classmethod
    def load(cls, name_or_file: Path | str, *, nested: bool = False) -> Mill:
        """A preset by name, or a TOML file: a machine file, what `times fit` writes, or a job. nested : may name no other file.

        Raises KinematicsError, JobError: No such preset or file, an unknown key, a value out of range.
        """
        if not isinstance(name_or_file, Path) and not name_or_file.lower().endswith(".toml"):
            name, known = str(name_or_file), load(str(name_or_file))
            return cls(name, known if known.rotary else None, MachineKeys(chain=name))
        path = Path(name_or_file)
        chain, legs, table = read_parts(path)
        try:
            keys = MachineKeys(**table)
        except ValidationError as exc:
            first = exc.errors()[0]
            raise JobError(
                f"[machine] {'.'.join(map(str, first['loc']))}: {first['msg']}", file=path
            ) from exc
        if nested and keys.file:
            raise KinematicsError("[machine] file: a machine file cannot name another one", file=path)
        if chain is not None:
            if keys.chain or keys.file:
                raise KinematicsError(
                    "[machine] chain and file: the chain is in this file already", file=path
                )
            return cls(chain.name, chain, keys, legs)
        return cls.of(keys, path.parent, path.stem)

    @classmethod
    def of(cls, keys: MachineKeys, folder: Path | str, name: str = "machine") -> Mill:
        """Of a table [machine]; file names are relative to `folder`. Keys that it does not give are those of its file.

        Raises KinematicsError, JobError: As `load`; a chain and a file, options without a chain.
        """
        if keys.file is not None:
            if keys.chain is not None or keys.options:
                raise KinematicsError(
                    "chain and file exclude each other", remedy="a file describes the chain"
                )
            named = cls.load(Path(folder) / keys.file, nested=True)
            given: dict[str, Any] = {
                **named.keys.model_dump(exclude_unset=True, exclude={"chain", "options"}), **keys.model_dump(exclude_unset=True)
            }  # fmt: skip
            return cls(named.name, named.chain, MachineKeys(**given), named.legs)
        if keys.options and keys.chain in (None, "xyz"):
            remedy = 'give chain = "ac-table", or leave them out'
            raise KinematicsError("options belong to a chain that turns", remedy=remedy)
        chain = None if keys.chain in (None, "xyz") else preset(str(keys.chain), **(keys.options or {}))
        return cls(str(keys.chain or name), chain, keys)


def limits_of(keys: MachineKeys) -> MachineLimits:
    given = keys.model_dump(exclude={"chain", "options", "file"})
    feed, rapid = (given.pop(f"{kind}_override_percent") / 100.0 for kind in ("feed", "rapid"))
    return MachineLimits(**given, feed_override=feed, rapid_override=rapid)
