"""What a user sees when something goes wrong: one message, an exit code, and no traceback."""

from __future__ import annotations

import gc
import os
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Sequence
from enum import IntEnum
from pathlib import Path
from types import FrameType

from vmachining.errors import EngineError, VMachiningError
from vmachining.notice import notice

REPORT_TO = "https://github.com/vmachining/vmachining/issues"

COMPILING = "compiling kernels, once: up to half a minute (`vmachining warm` does it ahead)"

GARBAGE = 50_000
"""Objects after which cycles are looked for: the usual 700 costs a tenth of a start, whose modules stay."""


class Code(IntEnum):
    """Exit codes."""

    DONE = 0
    FINDINGS = 1
    BAD_INPUT = 2
    BUG = 3
    INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> None:
    gc.set_threshold(GARBAGE)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # closed by the caller: a file of ours would get its number
            setattr(sys, name, Path(os.devnull).open(mode))  # noqa: SIM115
    try:
        # in every phase; a run listens by itself, see `progress.stop_flag`
        for number in (signal.SIGINT, signal.SIGTERM):
            # `nohup` and background jobs of a shell have it ignored
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, _interrupted)
        code = run(list(sys.argv[1:] if argv is None else argv))
    except KeyboardInterrupt:  # before `run` listens, or while it says its last words
        code = _say("interrupted", Code.INTERRUPTED)
    sys.exit(code)


def _interrupted(number: int, frame: FrameType | None) -> None:
    """An interruption is raised, but not into the import of a module: whoever imports there might swallow it."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            os.write(2, b"vmachining: interrupted while it was starting\n")
            os._exit(Code.INTERRUPTED)
        frame = frame.f_back
    raise KeyboardInterrupt


def run(argv: list[str]) -> int:
    """Run one command line; returns the exit code and never raises."""
    import typer

    from vmachining.cli.app import command

    # a warning in one line, without the place in our code
    warnings.showwarning = lambda message, *_, **__: print(f"vmachining: warning: {message}", file=sys.stderr)
    notice.compiling = None if {"--quiet", "-q"} & set(argv) else lambda: print(COMPILING, file=sys.stderr)
    usage_error = next(c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException")
    try:
        outcome = command().main(argv, prog_name="vmachining", standalone_mode=False)
        sys.stdout.flush()
        return int(outcome or 0)
    except (KeyboardInterrupt, typer.Abort):
        return _say("interrupted", Code.INTERRUPTED)
    except BrokenPipeError:  # the reader of our output has left: not our problem, and nothing more to say
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return Code.DONE
    except EngineError as exc:
        return _bug(exc, str(exc))
    except VMachiningError as exc:
        return _say(str(exc), Code.BAD_INPUT)
    except OSError as exc:
        where = f"{exc.filename}: " if exc.filename else ""
        return _say(f"{where}{exc.strerror or exc}", Code.BAD_INPUT)
    except MemoryError:
        return _say("out of memory; a larger chord_mm makes smaller meshes", Code.BAD_INPUT)
    except Exception as exc:
        if type(exc).__name__ == "NoArgsIsHelpError":  # a command alone
            return run([*argv, "--help"])
        if isinstance(exc, usage_error):
            return _say(_usage(exc), Code.BAD_INPUT)
        if type(exc).__name__ == "Stopped":
            return _say(str(exc), Code.INTERRUPTED)
        return _bug(exc, f"{type(exc).__name__}: {exc}")


def _usage(exc: Exception) -> str:
    """A usage error in one line, with where to look."""
    words = str(getattr(exc, "format_message", lambda: exc)()).strip()
    words = words.replace("\n", " ").replace("Value error, ", "")
    context = getattr(exc, "ctx", None)
    path = context.command_path if context is not None else "vmachining"
    return f"{words[:1].lower()}{words[1:].rstrip('.')}; see {path} --help"


def _say(message: str, code: Code) -> int:
    sys.stdout.flush()
    print(f"vmachining: {message}", file=sys.stderr)
    return int(code)


def _bug(exc: Exception, message: str) -> int:
    """An internal failure: one line for people, the traceback in a file for us."""
    note = ""
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="vmachining-crash-", suffix=".txt", delete=False, encoding="utf-8"
        ) as file:
            file.write("".join(traceback.format_exception(exc)))
        note = f" with {Path(file.name)}"
    except OSError:
        pass
    first = message.splitlines()[0] if message else "unknown"
    return _say(f"internal failure: {first}; please report it at {REPORT_TO}{note}", Code.BUG)
