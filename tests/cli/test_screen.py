"""Progress where nobody watches a terminal."""

from vmachining.cli import screen


def test_a_log_is_told_how_far_a_stage_is_and_how_long_it_still_takes(monkeypatch, capsys):
    """One line after ten seconds, the next half a minute later; 10 of 100 in 12 s leave 108 s."""
    clock = iter([0.0, 5.0, 12.0, 20.0, 45.0, 46.0])
    monkeypatch.setattr(screen.time, "monotonic", lambda: next(clock))
    with screen.progress_bar(quiet=False) as progress:
        for done in (0, 4, 10, 20, 50, 100):
            progress("engagement", done, 100)
    assert capsys.readouterr().err.splitlines() == [
        "contact and chips: 10 of 100, about 108 s left",
        "contact and chips: 50 of 100, about 45 s left",
    ]


def test_quiet_is_quiet():
    with screen.progress_bar(quiet=True) as progress:
        assert progress is None
