"""Forces against the reference numbers of the specification, computed there with 30 to 40 digits, and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from oracles.force_closed import shoulder_means, slot_means, tooth_force
from oracles.force_segments import (
    direction_matrix,
    edge_segments,
    elemental_forces,
    force_on,
    printed_direction_matrix,
)

from vmachining.engagement.frames import rotation
from vmachining.errors import InputError
from vmachining.force import Coefficients, bull_edge, cantilever_mm, deflection_force, edge_forces, shipped
from vmachining.force.identify import layer_integrals

K0 = Coefficients.constant(700, 250, 120, 25, 18, 4)
PUBLISHED = shipped("bull_d32_r4_published")
BULL = bull_edge(12.0, 4.0, 40.0)
R = 4.0
CHI = np.radians(11.0)

W1 = {
    15: (-260.551969, -43.0362215, 68.6400203), 60: (-422.462121, 328.370336, 94.2493717),
    90: (-222.125034, 551.887629, 99.8998436), 135: (177.785520, 428.700265, 87.5468680),
    165: (204.126513, 167.546446, 68.6400203), 200: (0, 0, 0),
}  # fmt: skip
W2 = {
    30: (-876.687235, 87.4760569, -151.633382), 60: (-1042.66061, 784.191865, -255.481739),
    90: (-565.151638, 1345.95143, -293.492876), 120: (157.799772, 1295.06651, -255.481739),
}  # fmt: skip
W3 = {
    15: (-530.180512, 117.811444, -7.26443382), 45: (-684.886602, 698.454793, 98.3745348),
    90: (31.1667033, 1262.74959, 167.394798), 150: (670.021527, 393.372635, 49.5698386),
}  # fmt: skip


def slot(coefficients, degrees, ap, *, chi=0.0, segments=20, tool=BULL, r=R, feed=0.2, frame=None, **more):
    """Forces of a full slot at rotation angles."""
    lower, upper = [0.0], [r * np.arccos(1.0 - min(ap, r) / r) if r else ap]
    if ap > r > 0.0:
        lower, upper = [*lower, r * np.pi / 2], [*upper, r * np.pi / 2 + ap - r]
    phi = np.radians(degrees)
    shape = (1, len(phi), len(lower))
    frame = np.eye(3) if frame is None else frame
    return edge_forces(
        tool, coefficients, phi, np.broadcast_to(lower, shape), np.broadcast_to(upper, shape), frame=frame,
        velocity=frame[:, 0], feed_per_tooth=feed, chi=chi, segments=segments, **more,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("coefficients", "ap", "chi", "wanted"), [(K0, 3, 0.0, W1), (K0, 8, CHI, W2), (PUBLISHED, 8, CHI, W3)]
)
def test_worked_examples(coefficients, ap, chi, wanted):
    found = slot(coefficients, list(wanted), ap, chi=chi).tool[0]
    np.testing.assert_allclose(found, list(wanted.values()), rtol=5e-9, atol=1e-6)


def test_forces_in_workpiece_axes_and_of_several_teeth():
    frame = rotation(np.radians(5.0), np.radians(10.0))
    leaning = slot(K0, [60], 8, chi=CHI, frame=frame).workpiece[0, 0]
    np.testing.assert_allclose(leaning, (-1071.18418901, 787.356117208, -1.92901630916), rtol=1e-10)
    four = slot(K0, np.arange(0, 360, 30), 8, chi=CHI, teeth=4).tool[0, 1]
    np.testing.assert_allclose(four, (-718.887463, 1382.54256, -407.115121), rtol=5e-9)
    two = slot(K0, np.arange(0, 360, 20), 8, chi=CHI, teeth=2).tool[0, 1]
    np.testing.assert_allclose(two, (-695.454916, -64.6225314, -106.811497), rtol=5e-9)


@pytest.mark.erratum("book", "7-6", "A13, A23 with plus: the determinant is cos 2 lam", "minus: a rotation")
def test_the_direction_matrix_is_a_rotation_and_the_printed_one_is_not():
    found = direction_matrix(np.radians(35.0), np.radians(50.0), CHI)
    wanted = [
        [0.80410191405080, 0.24895387073328, -0.53985375988943],
        [-0.56303822170723, 0.61037940292211, -0.55715791781613],
        [0.19080899537654, 0.75197004909462, 0.63097779085165],
    ]
    np.testing.assert_allclose(found, wanted, atol=1e-13)
    np.testing.assert_allclose(found.T @ found, np.eye(3), atol=1e-15)
    assert np.linalg.det(found) == pytest.approx(1.0)
    printed = printed_direction_matrix(np.radians(35.0), np.radians(50.0), CHI)
    assert np.linalg.det(printed) == pytest.approx(np.cos(np.radians(100.0)))


@pytest.mark.erratum(
    "book",
    "7-7",
    "M_F (F_t, F_r, F_a)",
    "-F_t c1 - F_a c2 + F_r c3: the print puts the radial force along the axis",
)
def test_the_book_order_differs_by_its_columns():
    """7-11 at phi = 90 degrees with the corrected matrix and (F_t, F_r, F_a), h = f sin phi."""
    total = np.zeros(3)
    for low, high in ((0.0, R * np.pi / 2), (R * np.pi / 2, R * np.pi / 2 + 4.0)):
        lam, length, z, _ = edge_segments([low], [high], 12.0, R, 20)
        t, r, a = elemental_forces(np.full_like(lam, 0.2), length, PUBLISHED.at(z))
        total += force_on(t, r, a, np.pi / 2, lam, CHI, convention="book").sum(axis=0)
    np.testing.assert_allclose(total, (444.856458, -1505.04904, 263.295903), rtol=5e-9)


def test_layer_integrals():
    found = layer_integrals(0.0, 3.0, R)
    wanted = (2.1521092250297, 3.0, 1.875, 3.8729833462074, 5.2724642866113)
    np.testing.assert_allclose(found, wanted, rtol=1e-13)
    np.testing.assert_allclose(
        layer_integrals(0.0, 8.0, R), (7.1415926535898, 8.0, 2.0, 4.0, 10.283185307180), rtol=1e-13
    )
    upper = np.add(layer_integrals(0.0, 2.0, R), layer_integrals(2.0, 8.0, R))
    np.testing.assert_allclose(upper, layer_integrals(0.0, 8.0, R), rtol=1e-14)


def test_closed_forms_of_a_slot():
    k = K0.powers[:, 0]
    at60 = tooth_force(np.radians(60.0), layer_integrals(0.0, 8.0, R), 0.2, k)
    np.testing.assert_allclose(at60, (-1055.88783157, 807.232866468, -21.8326754973), rtol=1e-11)
    at90 = tooth_force(np.radians(90.0), layer_integrals(0.0, 3.0, R), 0.2, k)
    np.testing.assert_allclose(at90, (-222.097394636, 551.811607165, 99.8130788310), rtol=1e-11)
    means = slot_means(layer_integrals(0.0, 8.0, R), 0.2, 2, k)
    np.testing.assert_allclose(means, (-304.39897991856, 723.66197723676, -5.4535209105297), rtol=1e-12)
    flat = slot_means(layer_integrals(0.0, 5.0, 0.0), 0.1, 4, k)
    np.testing.assert_allclose(
        flat * [1, 1, 1], (-239.59155902616, 509.15494309190, -116.39437268411), rtol=1e-12
    )


@pytest.mark.parametrize(("entry", "leave"), [(0.0, 60.0), (120.0, 180.0), (35.0, 110.0)])
def test_closed_forms_of_a_shoulder_are_means_of_the_instant(entry, leave):
    layer, k = layer_integrals(0.0, 6.0, R), K0.powers[:, 0]
    x, w = np.polynomial.legendre.leggauss(40)
    a, b = np.radians([entry, leave])
    phi = a + 0.5 * (b - a) * (x + 1.0)
    force = tooth_force(phi, layer, 0.15, k)
    mean = 3 / (2 * np.pi) * 0.5 * (b - a) * (w[:, None] * force).sum(axis=0)
    np.testing.assert_allclose(shoulder_means(a, b, layer, 0.15, 3, k), mean, rtol=1e-12, atol=1e-12)


@pytest.mark.erratum("book", "7-3", "lam_i = d lam (i - 1/2)", "lam_c + d lam (i - 1/2)")
def test_segments_converge_to_the_closed_form_with_the_square_of_their_number():
    k = K0.powers[:, 0]
    exact = tooth_force(np.radians(60.0), layer_integrals(0.0, 8.0, R), 0.2, k)
    error = [np.abs(slot(K0, [60], 8, segments=n).tool[0, 0] - exact).max() for n in (20, 40, 80)]
    assert (
        error[0] < 1.2e-4 * np.linalg.norm(exact)
        and 3.9 < error[0] / error[1] < 4.1
        and 3.9 < error[1] / error[2] < 4.1
    )


def test_mean_torque_and_power_of_a_slot():
    """Of a flat end in a slot one tooth after the other cuts: M = R a (Ktc f sin phi + Kte)."""
    flat = bull_edge(10.0, 0.0, 40.0)
    found = slot(K0, np.arange(0.5, 360.0), 3, tool=flat, r=0.0, feed=0.1, teeth=2)
    mean = 2 / (2 * np.pi) * 10 * 3 * (700 * 0.1 * 2 + 25 * np.pi)
    # midpoints of one degree: the sum over sin is high by (pi / 360)^2 / 6 of it
    assert found.torque.mean() == pytest.approx(mean, rel=2e-5)
    assert found.power(3000)[0] == pytest.approx(2 * np.pi * 50 * found.torque.mean() / 1000)
    radius = np.linalg.norm(found.tool[0, :, :2], axis=1)
    assert (radius > 0).all()


def test_torque_is_the_moment_of_the_force_about_the_axis():
    """F . e_t of every segment times its radius, helix or not: one segment at a time."""
    for chi in (0.0, CHI):
        one = slot(K0, [50], 3, chi=chi, segments=1)
        lam, _, _, rho = edge_segments([0.0], [R * np.arccos(0.25)], 12.0, R, 1)
        e_t = np.array([np.cos(np.radians(50)), -np.sin(np.radians(50)), 0.0])
        assert one.torque[0, 0] == pytest.approx(-rho[0] * float(one.tool[0, 0] @ e_t), rel=1e-12)
        assert lam[0] > 0


def test_no_chip_no_edge_force():
    """At phi = 0 and 180 degrees h vanishes; sin(pi) is 1.2e-16 in floating point."""
    assert not slot(K0, [0, 180], 3).tool.any()


def test_a_lag_turns_slices_and_keeps_the_mean():
    degrees = np.arange(360.0)
    straight = slot(K0, degrees, 8, chi=CHI, segments=40)
    lagging = slot(K0, degrees, 8, chi=CHI, segments=40, lag=True)
    # the mean of the torque knows nothing of when a slice cuts; a slice above another cuts later
    assert lagging.torque.mean() == pytest.approx(straight.torque.mean(), rel=1e-12)
    assert (
        lagging.torque[0, 3] < straight.torque[0, 3] and lagging.torque[0, 183] > 0 == straight.torque[0, 183]
    )
    # one slice at height z: the same curve, z tan(chi) / R later
    edge = {"tool": bull_edge(16.0, 0.0, 40.0), "r": 0.0}
    thin = slot(K0, degrees, 1e-3, chi=CHI, segments=1, lag=True, **edge).torque[0]
    plain = slot(K0, degrees, 1e-3, chi=CHI, segments=1, **edge).torque[0]
    assert np.abs(thin - plain).max() < 1e-3 * plain.max() + plain.max() * 5e-4 / 16 * np.tan(CHI) * 60


def test_a_cantilever_bends_and_back():
    bent = cantilever_mm(300.0, 60.0, 10.0, 6e5)
    assert bent == pytest.approx(300 * 60**3 / (3 * 6e5 * np.pi * 10**4 / 64))
    assert deflection_force(float(bent), 60.0, 10.0, 6e5) == pytest.approx(300.0)


@pytest.mark.erratum(
    "book",
    "7-11",
    "coefficients of a real alloy",
    "K_ac, K_rc and K_ae turn negative within the stated range: radial and axial may be exchanged",
)
def test_the_published_set_runs_and_says_what_is_odd_about_it():
    values = PUBLISHED.at([1.0, 2.5, 4.0, 10.0])
    wanted = [
        [649.2498, 52.7463, -136.559, 27.7567, 1.3, 3.9507],
        [559.56585, 31.8447, -295.9648625, 30.6938125, 0.7654375, 6.3165],
        [524.3715, 1.8396, -339.2201, 31.7128, 2.3731, 5.247],
        [573.3051, -85.7718, -327.8783, 24.586, 13.8235, -12.243],
    ]
    np.testing.assert_allclose(values.T, wanted, atol=1e-6)
    told = PUBLISHED.negative(0.0, 10.0)
    assert [words.split()[0] for words in told] == ["Krc", "Kac", "Kae"] or len(told) >= 3
    assert "10" in (PUBLISHED.outside(0.0, 12.5) or "") and PUBLISHED.outside(0.5, 9.0) is None


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: slot(K0, np.arange(0, 360, 10), 3, teeth=7), "7 teeth do not divide 36"),
        (lambda: slot(K0, [60], 3, teeth=0), "0 teeth"),
        (lambda: slot(K0, [60], 3, segments=0), "0 segments"),
        (lambda: shipped("unobtainium"), "no coefficient set"),
        (lambda: Coefficients("k", np.ones((5, 1))), "six finite"),
        (lambda: force_on(1, 1, 1, 0, 0, convention="other"), "unknown convention"),  # type: ignore[arg-type]
    ],
)
def test_bad_input_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call()
