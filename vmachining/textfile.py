"""Text files that a user wrote, or one clear reason why they cannot be read."""

from __future__ import annotations

from pathlib import Path

from vmachining.errors import InputError

__all__ = ["read_text"]


def read_text(
    path: Path, what: str, error: type[InputError], *, missing: str | None = None, wrong: str | None = None
) -> str:
    """The whole text of a UTF-8 file, with or without a byte order mark.

    what : names the file in the message. missing, wrong : remedies if it cannot be read, or is no such text.

    Raises
    ------
    error
        It cannot be read, or is not UTF-8.
    """
    try:
        return path.read_bytes().decode("utf-8-sig")
    except OSError as exc:
        raise error(f"cannot read the {what}: {exc.strerror or exc}", file=str(path), remedy=missing) from exc
    except UnicodeDecodeError as exc:
        raise error(f"not a UTF-8 text (byte {exc.start})", file=str(path), remedy=wrong) from exc
