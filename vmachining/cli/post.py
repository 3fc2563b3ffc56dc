"""post: a program, CL file or table of poses as a program for a control."""

from __future__ import annotations

import math
import re

from vmachining.cli.main import Code
from vmachining.cli.nc_commands import Post
from vmachining.cli.screen import emit, note
from vmachining.errors import InputError
from vmachining.job.files import write_atomic
from vmachining.job.reading import refuse_unread
from vmachining.machine import load
from vmachining.nc import read_program
from vmachining.report.figures import html_name, write_joints
from vmachining.toolpath.post import post_program


def post(o: Post) -> int:
    source, out, plot = o.source, o.out, o.plot
    if str(out) != "-" and out.exists() and not o.force:
        raise InputError(f"{out} exists already", remedy="--out another name, or --force")
    if str(out) != "-" and not out.parent.is_dir():
        raise InputError(f"--out {out}: there is no directory {out.parent}")
    if plot is not None:
        html_name(plot, "--plot")
    program = read_program(source, dialect=o.source_dialect, rotary="ABC", home=(0.0, 0.0, 100.0))
    program.require_clean()
    refuse_unread(program)
    chain = None if o.machine is None else load(o.machine)
    posted = post_program(
        program.moves, o.dialect, machine=chain, name=source.stem, decimals=o.decimals, angle_deg=o.angle,
        start_deg=None if o.start is None else _angles(o.start),
    )  # fmt: skip
    text, told = posted.text, posted.notes
    if plot is not None:
        if chain is None or posted.joints is None:
            remedy = "--machine NAME, --dialect iso"
            raise InputError("--plot: no machine was given, so there are no angles", remedy=remedy)
        write_joints(chain, posted.joints, posted.lines, plot, name=source.stem)
    if str(out) == "-" and not o.as_json:
        print(text, end="")
    elif str(out) != "-":
        write_atomic(out, text)
    for line in told:
        note(line)
    if o.as_json:
        jumps = () if posted.joints is None else posted.joints.jumps
        emit({
            "program": str(out), "dialect": o.dialect, "lines": text.count("\n"), "notes": list(told),
            "jumps": [{"line": posted.lines[j.pose], "axis": j.name, "turn_deg": math.degrees(j.turn), "kind": j.kind,
                       "rapid": posted.rapid[j.pose]}
                      for j in jumps],
        })  # fmt: skip
    elif str(out) != "-":
        note(f"{out}: written, {text.count(chr(10))} lines, dialect {o.dialect}")
    return Code.DONE


def _angles(text: str) -> dict[str, float]:
    """Angles by axis, from "A0,C90"."""
    word = r"\s*([A-Za-z])\s*=?\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*"
    if not re.fullmatch(rf"{word}(?:,{word})*", text):
        raise InputError(f"--start {text!r}: expected angles in degrees, such as A0,C90")
    return {letter: float(angle) for letter, angle in re.findall(word, text)}
