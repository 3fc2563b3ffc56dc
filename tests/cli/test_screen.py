"""Progress where nobody watches a terminal."""

from vmachining.cli import screen


def test_a_log_is_told_how_far_a_stage_is_and_how_long_it_still_takes(monkeypatch, capsys):
    """A line after ten seconds, the next half a minute later. Two blocks wait 40 s for kernels, which the time left does
    not count: 44 blocks took 44 s since, so 54 take 54 s."""
    clock = iter([0.0, 40.0, 51.0, 60.0, 84.0, 90.0])
    monkeypatch.setattr(screen.time, "monotonic", lambda: next(clock))
    with screen.progress_bar(quiet=False) as progress:
        for done in (0, 2, 12, 20, 46, 100):
            progress("engagement", done, 100)
    assert capsys.readouterr().err.splitlines() == [
        "contact and chips: 2 of 100",
        "contact and chips: 46 of 100, about 54 s left",
    ]


def test_quiet_is_quiet():
    with screen.progress_bar(quiet=True) as progress:
        assert progress is None
