"""The bar of a long call: a line on stderr that goes away, an element below the cell in a notebook."""

from __future__ import annotations

import re

import pytest

from vmachining.progress import shown


def test_a_function_hears_every_step_and_nothing_is_shown_by_default(capsys):
    heard = []
    with shown(lambda *step: heard.append(step)) as progress:
        for k in range(3):
            progress("cut", k, 2)
    assert heard == [("cut", 0, 2), ("cut", 1, 2), ("cut", 2, 2)]
    for none in (None, False):
        with shown(none) as progress:
            progress("cut", 1, 2)
    assert capsys.readouterr() == ("", "")


def test_the_line_of_a_terminal_is_wiped_at_the_end(capsys):
    with pytest.raises(KeyboardInterrupt), shown(True) as progress:
        for k in range(1000):
            progress("cut", k, 999)
        raise KeyboardInterrupt
    out, err = capsys.readouterr()
    assert out == "" and "\r\x1b[Kcut: 999 of 999" in err and err.endswith("\r\x1b[K")
    assert err.count("cut:") < 500  # not one line per block


@pytest.mark.slow  # starts a kernel
def test_a_notebook_shows_a_bar_below_its_cell():
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    code = "from vmachining.progress import shown\nwith shown(True) as p:\n    p('cut <1>', 3, 12)"
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code)])
    book.metadata["kernelspec"] = {"name": "python3", "display_name": "python3", "language": "python"}
    client = nbclient.NotebookClient(book, timeout=120)
    seen = []
    process = client.process_message

    def watched(message, cell, index):
        if message["msg_type"] == "update_display_data":
            seen.append(message["content"]["data"]["text/html"])
        return process(message, cell, index)

    client.process_message = watched
    client.execute()
    assert re.fullmatch(r'<progress value="3" max="12"></progress> cut &lt;1&gt;: 3 of 12', seen[0])
    assert seen[-1] == ""
