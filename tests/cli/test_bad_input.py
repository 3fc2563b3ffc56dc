"""What a user can get wrong: one clear message, exit code 2, and nothing on disk that looks like a result."""

from __future__ import annotations

import errno
import json
import random
import time

import numpy as np
import pytest
import trimesh
from slowness import slowness
from tinyjob import FEED, JOB, PROGRAM, write_job

from vmachining.cli.main import run

BOX = "box = { min = [0, 0, -4], max = [10, 18, 0] }"


def refused(capsys, argv, *words):
    """The command ends with 2 and one line that has all the words."""
    assert run([str(part) for part in argv]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and err.startswith("vmachining: "), err
    for word in words:
        assert word in err, err


def block(scale=1.0):
    """The box stock of the tiny job as a mesh."""
    box = trimesh.creation.box(bounds=np.array([[0, 0, -4], [10, 18, 0]]) * scale)
    return box


def open_block():
    box = block()
    return trimesh.Trimesh(box.vertices, box.faces[:-1], process=False)


def inside_out():
    box = block()
    return trimesh.Trimesh(box.vertices, box.faces[:, ::-1], process=False)


def one_face_turned():
    box = block()
    return trimesh.Trimesh(box.vertices, np.vstack([box.faces[:1, ::-1], box.faces[1:]]), process=False)


def with_a_fin():
    box = block()
    return trimesh.Trimesh(
        np.vstack([box.vertices, [[20, 20, 20]]]), np.vstack([box.faces, [[0, 7, 8]]]), process=False
    )


def overlapping():
    return trimesh.util.concatenate([block(), trimesh.creation.box(bounds=[[4, 4, -3], [12, 9, -1]])])


def crossed():
    """A box inside a box with the same orientation: the inner space would count twice."""
    return trimesh.util.concatenate([block(), trimesh.creation.box(bounds=[[2, 3, -3], [7, 12, -1]])])


STL = {
    "open": (open_block, ["open", "repair"]),
    "inside out": (inside_out, ["no volume", "orientation"]),
    "one face turned": (one_face_turned, ["not a closed"]),
    "fin": (with_a_fin, ["s.stl"]),
    "overlap": (overlapping, ["passes through itself", "join"]),
    "twice": (crossed, ["passes through itself", "join"]),
    "metres": (lambda: block(0.001), ["reaches the stock", "units"]),
}


@pytest.mark.parametrize("case", STL)
def test_a_broken_stl_is_refused(case, tmp_path, capsys):
    make, words = STL[case]
    job = write_job(tmp_path, swap={BOX: 'stl = "s.stl"'})
    make().export(tmp_path / "s.stl")
    refused(capsys, ["run", job, "--out", tmp_path / "out"], *words)
    assert not (tmp_path / "out").exists()


def test_an_stl_of_two_parts_and_one_with_a_cavity_are_solids(tmp_path, capsys):
    job = write_job(tmp_path, swap={BOX: 'stl = "s.stl"'})
    hollow = trimesh.creation.box(bounds=[[2, 3, -3.5], [7, 12, -2.5]])
    hollow.invert()
    apart = trimesh.creation.box(bounds=[[10, 0, -4], [14, 18, 0]])  # touches the first along a face
    for other, volume in ((hollow, 720 - 45), (apart, 720 + 288)):
        trimesh.util.concatenate([block(), other]).export(tmp_path / "s.stl")
        assert run(["run", str(job), "--out", str(tmp_path / "out"), "--stock", "", "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["stock_mm3"] == pytest.approx(volume, rel=1e-6)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", ["s.stl"]),
        (b"solid x\nfacet normal a b c\n", ["s.stl"]),
        (b"x" * 80 + (12).to_bytes(4, "little") + b"\0" * 300, ["s.stl"]),
    ],
    ids=["empty", "text", "cut off"],
)
def test_a_file_that_is_no_stl(data, words, tmp_path, capsys):
    job = write_job(tmp_path, swap={BOX: 'stl = "s.stl"'})
    (tmp_path / "s.stl").write_bytes(data)
    refused(capsys, ["run", job, "--out", tmp_path / "out"], *words)


def test_an_open_shell_and_half_a_file_are_no_step_stock(tmp_path, capsys):
    cq = pytest.importorskip("cadquery")
    box = cq.Workplane().box(10, 18, 4).val()
    job = write_job(tmp_path, swap={BOX: 'step = "s.step"'})
    cq.exporters.export(cq.Workplane(cq.Shell.makeShell(box.Faces()[:5])), str(tmp_path / "s.step"))
    refused(capsys, ["run", job, "--out", tmp_path / "out"], "s.step", "no solid", "closed solid")
    cq.exporters.export(cq.Workplane(box), str(tmp_path / "s.step"))
    text = (tmp_path / "s.step").read_text()
    (tmp_path / "s.step").write_text(text[: len(text) // 2])
    refused(capsys, ["run", job, "--out", tmp_path / "out"], "s.step", "is it the right file?")


def garbage(kind):
    rng = random.Random(1)
    if kind == "bytes":
        return rng.randbytes(10_000_000)
    if kind == "one line":
        return bytes(rng.choices(range(33, 126), k=100_000)) * 100
    if kind == "lines":
        return (bytes(rng.choices(range(33, 126), k=99)) + b"\n") * 100_000
    return b"G999 X\n" * 1_500_000


@pytest.mark.parametrize("kind", ["bytes", "one line", "lines", "codes"])
def test_ten_megabytes_of_garbage_are_answered_in_seconds(kind, tmp_path, capsys):
    job = write_job(tmp_path)
    (tmp_path / "tiny.nc").write_bytes(garbage(kind))
    begin = time.process_time()
    refused(capsys, ["run", job, "--out", tmp_path / "out"], "tiny.nc:")
    assert time.process_time() - begin < 10.0 * slowness()
    assert not (tmp_path / "out").exists()


NOT_TEXT = {"binary": bytes(range(256)) * 40, "utf-16": PROGRAM.encode("utf-16"), "nulls": b"\0" * 1000}


@pytest.mark.parametrize("kind", NOT_TEXT)
def test_a_program_that_is_no_text(kind, tmp_path, capsys):
    job = write_job(tmp_path)
    (tmp_path / "tiny.nc").write_bytes(NOT_TEXT[kind])
    refused(capsys, ["run", job, "--out", tmp_path / "out"], "tiny.nc:1", "save it as")
    refused(capsys, ["nc", "moves", tmp_path / "tiny.nc"], "tiny.nc:1", "save it as")


KEYS = {
    "misplaced": ({'units = "mm"': 'units = "mm"\nchord_mm = 1'}, ["job.toml:3:1", "under [accuracy]"]),
    "one bracket": ({"[[tools]]": "[tools]"}, ["job.toml:12:1", "two brackets"]),
    "no table": ({"[machine]": "machine = 3\n[[tools]]"}, ["job.toml"]),
    "short box": ({"max = [10, 18, 0]": "max = [10, 18]"}, ["job.toml:19", "2 numbers"]),
    "program directory": ({'"tiny.nc"': '"sub"'}, ["job.toml:5:1", "is a directory"]),
    "empty name": ({'"tiny.nc"': '""'}, ["job.toml:5:1", "empty"]),
    "no number": ({"number = 1\n": ""}, ["job.toml:12:1", "number is missing"]),
    "inch profile": (
        {'units = "mm"': 'units = "inch"', 'type = "flat"\ndiameter_mm = 4': 'type = "profile"\nprofile = [1, "a"]'},
        ["job.toml:15:1", "profile"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", KEYS)
def test_a_wrong_key_is_named_with_its_line(case, tmp_path, capsys):
    swap, words = KEYS[case]
    job = write_job(tmp_path, swap=swap)
    (tmp_path / "sub").mkdir()
    refused(capsys, ["run", job, "--out", tmp_path / "out"], *words)


def test_one_complaint_about_one_value(tmp_path, capsys):
    job = write_job(tmp_path, job=JOB + FEED + 'reference = "autp"\n')
    refused(capsys, ["run", job], "did you mean 'auto'?")
    job = write_job(tmp_path, job=JOB + FEED + "reference = -1\n")
    assert run(["run", str(job)]) == 2
    assert "more after" not in capsys.readouterr().err


def test_out_must_be_a_directory_that_can_be_written(tmp_path, capsys, monkeypatch):
    job = write_job(tmp_path)
    (tmp_path / "file").write_text("mine")
    refused(capsys, ["run", job, "--out", tmp_path / "file"], "file", "--out")
    refused(capsys, ["batch", job, "--out", tmp_path / "file"], "file", "--out")
    refused(capsys, ["run", job, "--out", tmp_path / "file" / "below"], "file", "--out")
    assert (tmp_path / "file").read_text() == "mine"

    def full(self, target):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", full)
    refused(capsys, ["run", job, "--out", tmp_path / "out"], "out", "No space left", "free some disk space")


def test_a_refused_run_leaves_an_earlier_result_and_a_new_one_replaces_all_of_it(tmp_path, capsys):
    out = tmp_path / "out"
    assert run(["run", str(write_job(tmp_path, job=JOB + FEED)), "--out", str(out), "--quiet"]) == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    assert "scheduled.nc" in before and "stock.stl" in before
    refused(capsys, ["run", write_job(tmp_path, program=""), "--out", out], "empty")
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    job = write_job(tmp_path)  # no schedule any more, and no stock file asked for
    assert run(["run", str(job), "--out", str(out), "--stock", "", "--quiet"]) == 0
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["complete"] and {p.name for p in out.iterdir()} == {
        *manifest["outputs"],
        "manifest.json",
        "stages.zip",
    }
    assert "scheduled.nc" not in manifest["outputs"] and "stock.stl" not in manifest["outputs"]


def test_names_with_blanks_and_marks_and_a_program_that_is_html(tmp_path, capsys):
    folder = tmp_path / "a b ünï <i>&amp;"
    program = PROGRAM.replace("N60 G1 X14 F600", "N60 G1 X14 F600 ; </script><script>alert(1)</script><b>x")
    swap = {'name = "tiny"': 'name = "<script>alert(2)</script> ü"'}
    job = write_job(folder, program=program, job=JOB + FEED, swap=swap)
    assert run(["run", str(job), "--out", str(folder / "o ü"), "--json"]) == 0
    assert capsys.readouterr().err == ""
    page = (folder / "o ü" / "report.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page and "</script><script>alert" not in page and "<b>x" not in page
    assert page.count("</script>") == page.count("<script")


NONSENSE = (
    "nc check {nc} --tools-units nonsense",
    "nc moves {nc} --tools-units nonsense",
    "dda {nc} --tools-units nonsense",
    "nc check {nc} --subroutines nonsense",
    "nc plot {nc} --subroutines nonsense",
    "nc check {nc} --home nan,0,0",
    "toolpath surface {stl} --tool ball:6 --scallop 1 --normals nonsense",
    "force identify nonsense.csv --corner-radius 0 --teeth 2 --layer-ref nonsense",
    "force identify nonsense.csv --corner-radius 0 --teeth 2 --method layers --weights nonsense",
)
UNREAD = (
    ("nc check {nc} --tools-units inch", "--tools-units"),
    ("nc check {nc} --from-line 9999", "9999"),
    ("compare {nc} {dir} --blocks 3", "--blocks"),
    ("compare {nc} {dir} --out o", "--out"),
    ("compare {job} --engines mesh,rays --tolerance-rel 1", "--tolerance-rel"),
    ("engage {job} --block 1 --every 2 --at 0.3", "--at"),
    ("view {dir} --engine mesh", "--engine"),
    ("strategies {dir} --engine mesh", "--engine"),
)


@pytest.mark.parametrize(("line", "word"), [*((line, "") for line in NONSENSE), *UNREAD])
def test_no_option_is_passed_over_because_another_one_is_missing(line, word, tmp_path, capsys):
    job = write_job(tmp_path)
    block().export(tmp_path / "part.stl")
    words = {"nc": job.parent / "tiny.nc", "stl": tmp_path / "part.stl", "dir": tmp_path, "job": job}
    refused(capsys, line.format(**words).split(), word or ("nonsense" if "nonsense" in line else "nan"))
