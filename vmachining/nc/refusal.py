"""What cannot be executed, and why: raised where it is found, told where its block is known."""

from __future__ import annotations


class PenError(Exception):
    """The block cannot be executed. code : of the catalogue. word : to blame, where it is known."""

    def __init__(self, code: str, message: str, word: str = "", hint: str = "") -> None:
        super().__init__(message)
        self.code, self.word, self.hint = code, word, hint


def refused(what: str, word: str = "", hint: str = "") -> PenError:
    """What is not read."""
    return PenError("E208", f"{what} is not supported", word, hint)


def misread(text: str) -> PenError:
    """A part of a block that follows no form that is known."""
    return PenError("E109", f"'{text}' is not understood", text)


class ArcError(PenError):
    """The arc does not exist."""


class CompensationError(PenError):
    """The tool cannot go there."""


class CornerError(PenError):
    """The corner cannot be made."""

    def __init__(self, message: str) -> None:
        super().__init__("E355", message)


class RecordError(PenError):
    """A record of a cutter location file that cannot be executed."""

    def __init__(self, code: str, message: str, hint: str = "") -> None:
        super().__init__(code, message, "", hint)
