"""machine: what a preset or machine file can do, as text, JSON and a page; post: a program, CL file or table of poses as a
program for a control."""

from __future__ import annotations

import math
import re
from pathlib import Path

from vmachining.cli.job_commands import Describe
from vmachining.cli.main import Code
from vmachining.cli.nc_commands import Post
from vmachining.cli.screen import emit, note
from vmachining.errors import InputError
from vmachining.job.files import write_atomic
from vmachining.job.mill import Mill
from vmachining.job.reading import refuse_unread
from vmachining.machine import PRESETS, described, load
from vmachining.nc import read_program
from vmachining.report.figures import html_name, write_joints
from vmachining.report.machine import machine_record, write_machine
from vmachining.toolpath.post import post_program


def machine(o: Describe) -> int:
    if o.name is None:
        for known in PRESETS:
            told = machine_record(Mill.load(known))
            print(f"{known:<15} {told['configuration']:<10} {told['class']}  {told['words']}")
        return Code.DONE
    mill = Mill.load(o.name)
    told = machine_record(mill)
    if o.as_json:
        emit(told)
    else:
        print(f"{told['name']}: {told['configuration']}, class {told['class']}: {told['words']}")
        for axis in told["axes"]:
            low, high, speed = axis["min"], axis["max"], axis["max_speed_min"]
            stated = low is not None and high is not None
            travel = f"{low:g} to {high:g} {axis['unit']}" if stated else "travel not stated"
            fast = "" if speed is None else f", {speed:g} {axis['unit']}/min"
            print(f"  {axis['name']}  {axis['kind']}, carries the {axis['carries']}: {travel}{fast}")
        for words in [] if mill.chain is None else described(mill.chain)["rotary"]:
            print(f"  {words}")
        for key, value in (*told["limits"].items(), *told["options"].items()):
            print(f"  {key} = {value}")
        if told["legs"] is not None:
            (low, high), home = told["legs"]["length_mm"], told["legs"]["home_mm"]
            print(f"  legs {low:g} to {high:g} mm, at home {min(home):.3f} to {max(home):.3f} mm")
    if not o.as_json or o.out is not None:
        page = html_name(o.out, "--out") if o.out is not None else Path(f"{mill.name.replace('/', '-')}.html")
        write_machine(mill, page)
        note(f"{page}: written")
    return Code.DONE


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
    angle = r"\s*([A-Za-z])\s*=?\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*"  # A0, or C = 90
    if o.start is not None and not re.fullmatch(rf"{angle}(?:,{angle})*", o.start):
        raise InputError(f"--start {o.start!r}: expected angles in degrees, such as A0,C90")
    start = None if o.start is None else {name: float(value) for name, value in re.findall(angle, o.start)}
    posted = post_program(
        program.moves, o.dialect, machine=chain, name=source.stem, decimals=o.decimals, angle_deg=o.angle, start_deg=start
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
