"""The page in a real browser: everything is linked, nothing fails, nothing is fetched."""

from __future__ import annotations

import shutil
import time

import numpy as np
import pytest
from tinyjob import FEED, JOB, PROGRAM, write_job

from vmachining.job import Job, run
from vmachining.report import write_report

pytest.importorskip("selenium", reason="selenium drives the browser")
BROWSER, DRIVER = shutil.which("chromium") or shutil.which("google-chrome"), shutil.which("chromedriver")
pytestmark = [
    pytest.mark.slow,  # a browser starts: 6 s
    pytest.mark.skipif(not (BROWSER and DRIVER), reason="no Chromium with its driver on this system"),
]
EVIL = "(</script><script>document.title='taken'</script><img src=x onerror=document.title='taken'>)"
FLAGS = (
    "--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run",
)  # fmt: skip


@pytest.fixture(scope="module")
def browser():
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    options = Options()
    options.binary_location = BROWSER
    for flag in FLAGS:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    driver.set_window_size(1280, 1400)
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def page(tmp_path_factory, browser):
    folder = tmp_path_factory.mktemp("browser")
    program = PROGRAM.replace("N70 G0 Z5", f"N70 G0 X-4 Y9 {EVIL}")
    result = run(Job.load(write_job(folder, job=JOB + FEED, program=program)))
    write_report(result, folder / "report.html")
    browser.get((folder / "report.html").as_uri())
    for _ in range(200):
        if ready(browser):
            break
        time.sleep(0.05)
    return result


def ready(browser):
    return browser.execute_script("return document.documentElement.dataset.ready")


def script(browser, text, *args):
    found = browser.execute_script(text, *args)
    # what is drawn is drawn with the next frames, however long they take
    browser.execute_async_script(
        "const done = arguments[0]; const next = (n) => requestAnimationFrame(() => (n ? next(n - 1) : setTimeout(done, 150)));"
        "next(2);"
    )
    return found


def marked(browser):
    """Block number in the details, and the marked line of the program."""
    return browser.execute_script(
        "return [document.querySelector('#details-title').textContent,"
        "(document.querySelector('.line.marked .code') ?? {}).textContent]"
    )


def test_it_starts_without_a_word_on_the_console(browser, page):
    assert ready(browser) == "3d"
    severe = [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
    assert severe == []


def test_program_text_stays_text(browser, page):
    assert browser.title.endswith("vmachining") and "taken" not in browser.title
    texts = script(browser, "return [...document.querySelectorAll('.line .code')].map((e) => e.textContent)")
    assert any(EVIL in text for text in texts)
    assert script(browser, "return document.querySelectorAll('#program img, #program script').length") == 0


def test_a_line_of_the_program_marks_its_block_everywhere(browser, page):
    blocks = page.blocks
    row = int(np.argmax(blocks["removed_mm3"].to_numpy()))
    text = blocks["text"][row]
    script(
        browser,
        "[...document.querySelectorAll('.line')].find((e) => e.querySelector('.code').textContent === arguments[0]).click()",
        text,
    )
    title, line = marked(browser)
    assert title == f"Block {blocks['block'][row]}, line {blocks['line'][row]}" and line == text
    values = script(browser, "return document.querySelector('#details-values').textContent")
    assert "between" in values and "mm³" in values


def test_a_row_of_the_table_marks_its_block(browser, page):
    block = script(
        browser,
        "const a = document.querySelector('#h-peaks ~ .wide [data-block]'); a.click(); return a.dataset.block",
    )
    assert marked(browser)[0].startswith(f"Block {block},")


def test_a_click_on_the_curve_marks_the_block_beneath(browser, page):
    from selenium.webdriver.common.action_chains import ActionChains

    over = browser.find_element("css selector", "#curves .u-over")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", over)
    time.sleep(0.6)
    size, count = over.size, len(page.blocks)
    row = count // 2
    x = (row + 0.5) / count * size["width"] - size["width"] / 2
    ActionChains(browser).move_to_element_with_offset(over, round(x), 0).click().perform()
    time.sleep(0.3)
    assert marked(browser)[0].startswith(f"Block {page.blocks['block'][row]},")


def test_the_contact_of_the_marked_block_is_drawn(browser, page):
    """Without a mark the most loaded block; of one in air no picture but words."""
    told = "return [document.querySelectorAll('#contact svg').length, document.querySelector('#contact-said').textContent]"
    loaded = page.blocks.filter(page.blocks["ap_mm"] > 0)["block"].to_list()
    for block, words in [(loaded[-1], f"Block {loaded[-1]}, at"), (0, "touches nothing in block 0")]:
        script(browser, "document.querySelectorAll('.line:not(.still)')[0].click()")
        for _ in range(block):
            script(
                browser,
                "document.body.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true}))",
            )
        count, said = script(browser, told)
        assert words in said and count == (3 if block in loaded else 0)
    script(
        browser, "document.body.dispatchEvent(new KeyboardEvent('keydown', {key: 'Escape', bubbles: true}))"
    )
    assert script(browser, told)[0] == 3


def test_keys_go_through_the_blocks(browser, page):
    script(browser, "document.querySelector('[data-block]').click()")
    first = int(marked(browser)[0].split()[1].rstrip(","))
    script(
        browser,
        "document.body.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true}))",
    )
    assert int(marked(browser)[0].split()[1].rstrip(",")) == first + 1
    script(
        browser, "document.body.dispatchEvent(new KeyboardEvent('keydown', {key: 'Escape', bubbles: true}))"
    )
    assert script(browser, "return document.querySelector('#details').hidden")


def picture(browser):
    """Pixels of the canvas, as its own data URL."""
    return script(browser, "return document.querySelector('#view canvas').toDataURL()")


def test_the_slider_shows_the_part_as_it_was_then(browser, page):
    before = picture(browser)
    script(
        browser,
        "const s = document.querySelector('#slider'); s.value = s.max / 2; s.dispatchEvent(new Event('input'))",
    )
    half = picture(browser)
    assert half != before and "block" in script(
        browser, "return document.querySelector('#place').textContent"
    )
    script(browser, "document.querySelector('#to-end').click()")
    assert picture(browser) == before


def test_play_runs_to_the_end(browser, page):
    script(
        browser, "document.querySelector('#speed').value = 'blocks'; document.querySelector('#play').click()"
    )
    time.sleep(1.0)
    moved = float(script(browser, "return document.querySelector('#slider').value"))
    script(browser, "document.querySelector('#play').click(); document.querySelector('#to-end').click()")
    assert 0.0 < moved < len(page.blocks)
    assert script(browser, "return document.querySelector('#place').textContent") == "finished part"


def test_a_click_on_the_part_marks_the_block_that_made_the_face(browser, page):
    """In the middle of the part stands a face; its block, or none for raw stock, is what the page marks."""
    from selenium.webdriver.common.action_chains import ActionChains

    canvas = browser.find_element("css selector", "#view canvas")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", canvas)
    time.sleep(0.6)
    found = set()
    for x in range(-120, 121, 24):
        for y in (-40, 0, 40):
            if len(found) > 2:
                break
            ActionChains(browser).move_to_element_with_offset(canvas, x, y).click().perform()
            if not browser.execute_script("return document.querySelector('#details').hidden"):
                found.add(int(marked(browser)[0].split()[1].rstrip(",")))
    made = set(np.unique(page.surface.block).tolist()) | set(page.blocks["block"].to_list())
    assert found and found <= made


def test_dark_narrow_and_print(browser, page):
    light = script(browser, "return getComputedStyle(document.body).backgroundColor")
    script(browser, "document.querySelector('#theme').click()")
    assert script(browser, "return getComputedStyle(document.body).backgroundColor") != light
    script(browser, "document.querySelector('#theme').click()")
    browser.set_window_size(500, 1200)
    widths = "return [document.documentElement.scrollWidth, document.documentElement.clientWidth]"
    for _ in range(40):  # plots follow when they hear of it
        wide = script(browser, widths)
        if wide[0] <= wide[1]:
            break
    browser.set_window_size(1280, 1400)
    assert wide[0] <= wide[1]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    hidden = script(browser, "return getComputedStyle(document.querySelector('.player')).display")
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    assert hidden == "none"
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


def test_a_run_in_hand_grows_on_the_page(browser, page, tmp_path):
    """Rows that the run has made, then more of them: curves, program and the part follow; then the frame shows the report."""
    from vmachining.job.folder import WORKING
    from vmachining.report.live import Live, live_page, serve

    live = Live(tmp_path, "tiny", page=live_page(page.job))
    table, place = page.blocks, "document.querySelector('iframe').contentDocument"
    live.progress("program", 3, len(table))
    server = serve(live)
    seen = []
    try:
        browser.get(f"http://127.0.0.1:{server.server_port}/")
        for count in (3, len(table)):
            table.head(count).write_csv(tmp_path / WORKING[0])
            wanted = f"block {table['block'][count - 1]} of"
            for _ in range(150):
                said = browser.execute_script(
                    f"return ({place}?.querySelector('#place') ?? {{}}).textContent ?? ''"
                )
                if said.startswith(wanted):
                    break
                time.sleep(0.1)
            assert said.startswith(wanted)
            time.sleep(0.5)
            drawn = (f"{place}.querySelector('#{name} canvas').toDataURL()" for name in ("curves", "view"))
            seen.append(script(browser, f"return {' + '.join(drawn)}"))
        assert seen[0] != seen[1] and "cutting" in script(
            browser, "return document.querySelector('#stage').textContent"
        )
        assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    finally:
        server.shutdown()
        browser.get("about:blank")


def test_a_leaning_tool_cuts_the_part_that_is_played(browser, tmp_path):
    """A flat cutter from the side takes a step off: the picture differs from the raw box, and both turn with the machine."""
    program = (
        "G21 G90 G17\nT1 M6\nS6000 M3\nG0 X40 Y-5 Z10\nG0 B90 C0\nG0 Z-1\nG0 X8\nG1 Y23 F500\nG0 X40\nM30\n"
    )
    job = JOB.replace("[machine]\n", '[machine]\nchain = "c-table-b-head"\n')
    result = run(Job.load(write_job(tmp_path, job=job, program=program)), contact="none", workers=1)
    write_report(result, tmp_path / "report.html")
    browser.get((tmp_path / "report.html").as_uri())
    for _ in range(200):
        if ready(browser):
            break
        time.sleep(0.05)
    seen = []
    for share in (0.0, 0.9):
        script(
            browser,
            "const s = document.querySelector('#slider'); s.value = arguments[0] * s.max; s.dispatchEvent(new Event('input'));"
            "s.dispatchEvent(new Event('change'))",
            share,
        )
        seen.append(picture(browser))
    assert seen[0] != seen[1]
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


def test_bodies_lines_and_points_are_drawn_without_a_run(browser, tmp_path):
    """A cube with a line and two places that tell their values; a layer that is switched off is gone."""
    from vmachining.report.figures import write_page
    from vmachining.report.scene import Layer, Scene
    from vmachining.stock import BoxStock

    cube, _ = BoxStock((0, 0, 0), (1, 1, 1)).mesh(0.1)
    line = np.array([[0, 0, 1.2], [1, 1, 1.2], [np.nan] * 3, [0, 1, 1.2], [1, 0, 1.2]])
    layers = [
        Layer(name="<b>cube</b>", points=cube.vertices, triangles=cube.triangles),
        Layer(name="line", points=line, colour="#d92d20"),
        Layer(name="places", points=line[[0, 1]], values=np.array([-0.1, 0.2]), blocks=np.array([3, -1])),
    ]
    scene = Scene(title="t", words="A cube", layers=layers, reach=0.2)
    write_page(tmp_path / "s.html", [], kind="test", name="cube", subtitle="", scene=scene)
    browser.get((tmp_path / "s.html").as_uri())
    for _ in range(200):
        if ready(browser):
            break
        time.sleep(0.05)
    before = picture(browser)
    assert (
        ready(browser) == "3d"
        and script(browser, "return document.querySelectorAll('#layers b').length") == 0
    )
    for k in range(3):
        script(browser, "document.querySelectorAll('#layers input')[arguments[0]].click()", k)
        before, after = picture(browser), before
        assert before != after
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


def test_a_batch_sorts_filters_and_sums_what_is_shown(browser, page, tmp_path):
    """Two jobs of which one name breaks out; the last line sums those that are shown."""
    from vmachining.report.batch import write_index

    rows = []
    for name, times in (("plate 9", 1.0), ("plate 10 <b>x</b>", 2.0)):
        folder = tmp_path / name.split(" <")[0].replace(" ", "_")
        folder.mkdir()
        page.blocks.write_parquet(folder / "blocks.parquet")
        numbers = (
            "blocks",
            "removed_mm3",
            "removed_lo_mm3",
            "removed_hi_mm3",
            "time_s",
            "seconds",
            "peak_mb",
        )
        rows.append(
            {name: times * page.summary[name] for name in numbers}
            | {"job": "a.toml", "name": name, "out": str(folder), "status": "done", "exit_code": 0, "message": "",
               "warnings": int(times) - 1, "scheduled_time_s": None, "mean_feed_mm_min": 1.0, "scheduled_mean_feed_mm_min": None}
        )  # fmt: skip
    ledger = {"command": ["vmachining"], "started": "now", "ended": "later", "versions": {}}
    write_index(rows, tmp_path / "index.html", ledger)
    browser.get((tmp_path / "index.html").as_uri())
    names = (
        "return [...document.querySelectorAll('#jobs tbody tr:not([hidden]) th')].map((e) => e.dataset.key)"
    )
    foot = "return [...document.querySelectorAll('#jobs tfoot .n')].map((e) => e.textContent.replaceAll('\\u202f', ''))"
    blocks, removed = (page.summary[name] for name in ("blocks", "removed_mm3"))
    assert float(script(browser, foot)[0]) == 3 * blocks
    assert float(script(browser, foot)[1]) == pytest.approx(3 * removed, rel=1e-6)
    assert (
        len(
            script(
                browser,
                "return [...document.querySelectorAll('.spark path')].map((e) => e.getAttribute('d'))",
            )
        )
        == 2
    )
    script(browser, "document.querySelector('#jobs th button').click()")
    assert script(browser, names) == ["plate 9", "plate 10 <b>x</b>"]  # as people count
    script(browser, "document.querySelector('#jobs th button').click()")
    assert script(browser, names) == ["plate 10 <b>x</b>", "plate 9"]
    script(
        browser,
        "const f = document.querySelector('#filter'); f.value = '10'; f.dispatchEvent(new Event('input'))",
    )
    assert script(browser, names) == ["plate 10 <b>x</b>"] and float(script(browser, foot)[0]) == 2 * blocks
    script(
        browser,
        "const f = document.querySelector('#filter'); f.value = ''; document.querySelector('#warned').click()",
    )
    assert script(browser, names) == ["plate 10 <b>x</b>"]
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []


def test_a_program_without_a_job_is_plotted(browser, tmp_path, capsys):
    from vmachining.cli.main import run as command

    (tmp_path / "p.nc").write_text(
        "G21 G90 G17\nT1 M6\nG0 X0 Y0 Z5\nG1 Z-1 F100\nG2 X10 Y0 I5 J0 F300\nG1 Y20\nG0 Z5\nM30\n"
    )
    assert command(["nc", "plot", str(tmp_path / "p.nc"), "--out", str(tmp_path / "p.html")]) == 0
    browser.get((tmp_path / "p.html").as_uri())
    for _ in range(200):
        if ready(browser):
            break
        time.sleep(0.05)
    assert ready(browser) == "3d"
    script(
        browser,
        "[...document.querySelectorAll('.line')].find((e) => e.textContent.includes('G1 Y20')).click()",
    )
    assert "line 6" in marked(browser)[0]
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
