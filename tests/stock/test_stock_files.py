"""Triangle files: what they build, and what is refused before memory goes."""

from __future__ import annotations

import struct
import sys
import tracemalloc
import zipfile

import numpy as np
import pytest

from vmachining.errors import StockError
from vmachining.job.stock import write_stock
from vmachining.stock import BoxStock, files, read_mesh

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
RELS = (
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="a" '
    'Target="/3D/3dmodel.model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
# a right tetrahedron with legs 1: volume 1/6
MESH = (
    '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/>'
    '<vertex x="0" y="0" z="1"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/>'
    '<triangle v1="0" v2="1" v3="3"/><triangle v1="0" v2="3" v3="2"/><triangle v1="1" v2="2" v3="3"/>'
    "</triangles></mesh>"
)


def model(resources, build='<item objectid="1"/>', unit='unit="millimeter"', head=""):
    return (
        f'<?xml version="1.0"?>{head}<model {unit} xmlns="{CORE}" '
        'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06">'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )


def package(path, **parts):
    """A 3MF file; `model` is its root part."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as out:
        out.writestr("_rels/.rels", RELS)
        for name, text in parts.items():
            out.writestr("3D/3dmodel.model" if name == "model" else f"3D/{name}.model", text)
    return path


def volume(stock):
    a, b, c = stock.vertices[stock.triangles].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


@pytest.fixture
def fresh_install(monkeypatch):
    """Only what `pip install vmachining` brings: trimesh alone needs these two for 3MF."""
    for name in ("networkx", "lxml"):
        monkeypatch.setitem(sys.modules, name, None)


@pytest.mark.usefixtures("fresh_install")
@pytest.mark.parametrize("suffix", [".3mf", ".stl"])
def test_a_written_stock_is_read_again(suffix, tmp_path):
    path = tmp_path / f"box{suffix}"
    write_stock(BoxStock((-3, -2, -5), (4, 6, 1)).mesh(0.1)[0], path)
    stock = read_mesh(path)
    assert volume(stock) == 7 * 8 * 6
    assert stock.bounds.tolist() == [[-3, -2, -5], [4, 6, 1]]


@pytest.mark.usefixtures("fresh_install")
@pytest.mark.parametrize(
    ("unit", "mm"),
    [("", 1.0), ('unit="inch"', 25.4), ('unit="meter"', 1000.0), ('unit="micron"', 1e-3)],
)
def test_a_3mf_file_is_read_in_its_own_unit(unit, mm, tmp_path):
    path = package(tmp_path / "a.3mf", model=model(f'<object id="1">{MESH}</object>', unit=unit))
    assert volume(read_mesh(path, scale=7.0)) == pytest.approx(mm**3 / 6)


def test_components_place_objects_of_other_parts(tmp_path):
    """Mirrored, turned by 90 degrees about z, and scaled by 2; a support is no part of the workpiece."""
    path = package(
        tmp_path / "a.3mf",
        other=model(f'<object id="7">{MESH}</object>', build=""),
        model=model(
            '<object id="1"><components><component p:path="/3D/other.model" objectid="7" '
            'transform="-2 0 0 0 1 0 0 0 1 0 0 0"/><component p:path="/3D/other.model" objectid="7" '
            'transform="0 1 0 -1 0 0 0 0 1 5 0 0"/></components></object>'
            f'<object id="2" type="support">{MESH}</object>',
            build='<item objectid="1" transform="1 0 0 0 1 0 0 0 2 0 0 10"/><item objectid="2"/>',
        ),
    )
    stock = read_mesh(path)
    # x: -2 to 0, and the turned one 4 to 5; z: twice the height, from 10
    assert stock.bounds.tolist() == [[-2, 0, 10], [5, 1, 12]]
    assert volume(stock) == pytest.approx((2 * 2 + 2) / 6)


LAUGHS = "<!DOCTYPE l [<!ENTITY a 'x'>" + "".join(
    f"<!ENTITY {b} '{f'&{a};' * 10}'>" for a, b in ("ab", "bc", "cd", "de", "ef", "fg", "gh", "hi")
)
NESTED = f'<object id="0">{MESH}</object>' + "".join(
    f'<object id="{k}"><components>' + f'<component objectid="{k - 1}"/>' * 10 + "</components></object>"
    for k in range(1, 13)
)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (model(f'<object id="1">{MESH}</object>', head=LAUGHS + "]>"), "document type"),
        (model(NESTED, build='<item objectid="12"/>'), "copies of objects take"),
        (
            model('<object id="1"><components><component objectid="1"/></components></object>'),
            "nested more than",
        ),
        (model("", build='<item objectid="3"/>'), "object 3 is missing"),
        (model(f'<object id="1">{MESH.replace("v3=", "v9=")}</object>'), "lacks 'v3'"),
        (model(f'<object id="1">{MESH.replace(chr(34) + "3", chr(34) + "33")}</object>'), "is missing"),
        (model(f'<object id="1">{MESH.replace(chr(34) + "3", chr(34) + "9" * 30)}</object>'), "line 1: "),
        (model(f'<object id="1">{MESH.replace(chr(34) + "1", chr(34) + "nan")}</object>'), "line 1: "),
        (model(f'<object id="1">{MESH}</object>', unit='unit="furlong"'), "unknown unit 'furlong'"),
        (model(f'<object id="1">{MESH}</object>', build='<item objectid="1" transform="1"/>'), "twelve"),
        ("<model", "is not XML"),
        (model("", build=""), "holds no triangles"),
    ],
    ids=[
        "entities", "copies", "circle", "lost", "attribute", "index", "digits", "nan", "unit", "transform", "xml",
        "empty",
    ],
)  # fmt: skip
def test_what_no_3mf_file_may_hold_is_refused(text, said, tmp_path):
    path = package(tmp_path / "a.3mf", model=text)
    with pytest.raises(StockError, match=said) as found:
        read_mesh(path)
    assert found.value.file == str(path)


@pytest.mark.parametrize("lie", [False, True], ids=["stated", "lied about"])
def test_a_small_file_that_unpacks_to_much_is_refused_before_memory_goes(lie, tmp_path, monkeypatch):
    """64 MB of blanks are 64 kB in the file; its directory may say less than there is."""
    monkeypatch.setattr(files, "available_bytes", lambda: 300 << 20)  # 20 MB unpacked
    path = package(tmp_path / "a.3mf", model=model(" " * (64 << 20)))
    if lie:
        data = bytearray(path.read_bytes())
        true = next(i.file_size for i in zipfile.ZipFile(path).infolist() if i.filename.startswith("3D"))
        assert data.count(struct.pack("<I", true)) == 2  # local header and directory
        path.write_bytes(bytes(data).replace(struct.pack("<I", true), struct.pack("<I", 9 << 20)))
    tracemalloc.start()
    with pytest.raises(StockError, match=r"cannot be read as a 3MF" if lie else r"unpacks to 64 MB"):
        read_mesh(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 << 20


@pytest.mark.parametrize("damage", ["empty", "cut", "no zip", "bit"])
def test_damaged_packages_are_refused(damage, tmp_path):
    path = package(tmp_path / "a.3mf", model=model(f'<object id="1">{MESH}</object>'))
    data = path.read_bytes()
    changed = {"empty": b"", "cut": data[: len(data) // 2], "no zip": b"solid a\nendsolid a\n"}
    at = data.index(b"3D/3dmodel.model") + 40
    path.write_bytes(changed.get(damage, data[:at] + bytes([data[at] ^ 0x55]) + data[at + 1 :]))
    with pytest.raises(StockError):
        read_mesh(path)


@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "3mf"])
def test_a_file_that_memory_cannot_hold_is_refused_by_its_size(kind, tmp_path):
    path = tmp_path / f"large.{kind}"
    with path.open("wb") as out:
        out.truncate(1 << 43)  # sparse: takes no room on the disk
    with pytest.raises(StockError, match=r"holds 8388608 MB; the memory available here reads"):
        read_mesh(path)


PLY = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n" \
    "element face {}\nproperty list uchar int vertex_indices\nend_header\n"  # fmt: skip


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.stl", b" " * 80 + struct.pack("<I", 2**32 - 1) + b"\0" * 50),
        ("a.ply", PLY.format("binary_little_endian", 10**12, 10**12).encode() + b"\0" * 99),
        ("a.ply", PLY.format("ascii", 10**12, 4).encode() + b"0 0 0\n" * 9),
        ("a.ply", PLY.format("ascii", 10**500, 4).encode() + b"0 0 0\n" * 9),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 999999999999\n"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999999999\n"),
        ("a.zip", b"PK\x03\x04"),
        ("a.dae", b"<COLLADA/>"),
        ("a", b"solid"),
    ],
    ids=["stl", "ply", "ascii ply", "ply digits", "obj", "obj digits", "zip", "dae", "nothing"],
)
def test_files_that_lie_about_their_size_or_kind_are_refused(name, data, tmp_path):
    path = tmp_path / name
    path.write_bytes(data)
    tracemalloc.start()
    with pytest.raises(StockError):
        read_mesh(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 64 << 20
