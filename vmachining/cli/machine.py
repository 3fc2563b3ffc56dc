"""machine: what a preset or machine file can do, as text, JSON and a page."""

from __future__ import annotations

from pathlib import Path

from vmachining.cli.job_commands import Describe
from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note
from vmachining.job.mill import Mill
from vmachining.machine import PRESETS, described
from vmachining.report.figures import html_name
from vmachining.report.machine import machine_record, write_machine


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
