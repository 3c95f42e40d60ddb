"""A whole report in a browser: what is seen, by whom, and that nothing is fetched."""

import pytest
from axe_playwright_python.sync_playwright import Axe

from snowrepro.store.run import Run
from tests.configs import carrying, changed
from tests.report import small_runs
from tests.report.reports import reported

HOSTILE = """<img src=x onerror=alert(1)> & "quo'tes" *not bold* [no](link) </script>"""
PLAIN = "_not bold_ (1 ~ 2)"  # what the name of an option may hold of it
WIDTHS = {"desktop": 1280, "phone": 390}


def report_of(runs: list[Run]) -> str:
    """The address of the report of Figure 5 on these runs."""
    return (reported(runs, ["experiment=fig5"]).evidence.folder / "index.html").absolute().as_uri()


@pytest.fixture(scope="module")
def runs(small_run, tmp_path_factory):
    """Four finished runs of one scene."""
    return small_runs.saved(small_run, tmp_path_factory.mktemp("store"), vanish=False)


@pytest.fixture(scope="module")
def address(runs):
    """A report with everything in it."""
    return report_of(runs)


@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
def test_all_is_seen_at_any_width(page, address, width):
    """No picture is broken or without words for it, and nothing is wider than the screen."""
    page.set_viewport_size({"width": width, "height": 800})
    page.goto(address)
    page.wait_for_selector("#viewer-body", state="visible")
    pictures = page.locator("main img")
    assert pictures.count() >= 7
    assert pictures.evaluate_all(
        "all => all.every(one => one.complete && one.naturalWidth > 100 && one.alt.length > 20)"
    )
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_the_first_screen_answers(page, address):
    """What was run, each claim with verdict and number, and the paper's figure, before all else."""
    page.goto(address)
    first = page.locator("#summary")
    text = first.inner_text()
    assert "4 of 4 runs are done" in text
    for claim in ("C1", "C2", "C2-loose", "C3", "C4", "C4-loose", "C5"):
        assert claim in text
    assert text.count("INCONCLUSIVE") == 7  # one seed in each cell decides nothing
    assert "mass in lumps" in text
    assert first.locator("figure").inner_text().startswith("Fig. 5.")


@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
def test_nothing_is_in_the_way_of_anyone(page, address, width):
    """axe-core: neither serious nor lesser findings, with all that can be opened open."""
    page.set_viewport_size({"width": width, "height": 800})
    page.goto(address)
    page.wait_for_selector("#viewer-body", state="visible")
    page.evaluate("document.querySelectorAll('details').forEach(one => one.open = true)")
    found = Axe().run(page)
    assert found.violations_count == 0, found.generate_report()


def test_without_javascript_all_but_the_viewer_is_there(browser, address):
    """Verdicts, pictures and tables are read; the viewer says why it is not there."""
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(address)
    assert "INCONCLUSIVE" in page.locator("#summary").inner_text()
    assert page.locator("main img").count() >= 7 and page.locator("main table:visible").count() >= 4
    assert "needs JavaScript" in page.locator("#moving").inner_text()
    assert not page.locator("#viewer").is_visible()
    context.close()


def test_on_paper_nothing_is_cut(page, address):
    """Printed, tables stand open at full length, and what needs a hand is left out."""
    page.goto(address)
    page.wait_for_selector("#viewer-body", state="visible")
    page.emulate_media(media="print")
    assert not page.locator("#moving").is_visible() and not page.locator("nav").is_visible()
    assert page.locator(".table:visible").evaluate_all(
        "all => all.every(one => one.scrollHeight <= one.clientHeight + 1)"
    )


def test_each_picture_leads_to_its_origin(page, address):
    """Data, runs, settings, what made them, and the command; every link within the page has an end."""
    page.goto(address)
    links = page.locator("figure").first.locator(".links")
    assert links.inner_text().startswith("data: strip.csv")
    assert "snowrepro run experiment=fig5" in links.inner_text()
    content = page.evaluate("async () => (await fetch(document.querySelector('.links a').href)).text()")
    assert content.startswith("row,frame,")
    ends = page.locator("a[href^='#']").evaluate_all("all => all.map(one => one.getAttribute('href').slice(1))")
    assert len(ends) > 20
    assert all(page.evaluate("id => document.getElementById(id) !== null", end) for end in set(ends))
    assert "shape:" in page.locator("[id^=runs-] details").last.text_content()


def test_the_viewer_and_the_table_of_runs_say_the_same(page, address):
    """The shares at the last frame are those of the list of runs, as far as that has digits."""
    page.goto(address)
    page.wait_for_selector("#viewer-body", state="visible")
    shown = page.locator("#viewer-runs data").evaluate_all("all => all.map(one => Number(one.value))")
    page.evaluate("document.querySelectorAll('details').forEach(one => one.open = true)")
    table = page.locator("[id^=runs-] table").first
    heads = table.locator("th").all_inner_texts()
    wanted = [heads.index(name) for name in ("mass in lumps", "crushed", "loose")]
    cells = [row.locator("td").all_inner_texts() for row in table.locator("tbody tr").all()]
    listed = [text for row in cells for text in (row[place] for place in wanted)]
    assert len(listed) == len(shown) == 12
    for text, value in zip(listed, shown, strict=True):
        digits = len(text.partition(".")[2])
        assert float(text) == pytest.approx(value, abs=0.51 * 10**-digits)


def test_hostile_names_come_out_as_text(page, runs, small_run, tmp_path):
    """Names and statements from files may hold anything that HTML or Markdown knows."""
    question = runs[0].config.question
    claims = question.claims
    worded = claims.model_copy(update={"list": tuple(c.model_copy(update={"statement": HOSTILE}) for c in claims.list)})
    experiment = question.experiment.model_copy(update={"title": f"Title {HOSTILE}", "says": HOSTILE})
    asked = {"claims": worded, "experiment": experiment, "store": str(tmp_path), "reports": str(tmp_path)}
    renamed = [
        Run(changed(run.config, **asked, shape=run.case.shape.model_copy(update={"name": PLAIN}))) for run in runs[:3]
    ]
    for run in renamed[:2]:
        run.save(carrying(small_run, run.config), wall_seconds=1.0, seconds_per_frame=0.1)
    page.goto(report_of(renamed))
    page.wait_for_selector("#viewer-body", state="visible")
    assert HOSTILE in page.locator("h1").inner_text()
    assert page.locator("#summary").inner_text().count(HOSTILE) == 7
    assert HOSTILE in page.locator("blockquote").first.inner_text()
    assert PLAIN in page.locator("#missing").inner_text()
    assert page.locator("img[src=x]").count() == 0 and page.locator("em").count() == 0
    assert page.locator("a[href=link]").count() == 0
