"""The replay: one self-contained, safe HTML page that plays."""

import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from sim import Box, Recording, Simulator, Twist, World, drive
from sim.replay import Replay


def test_in_the_replay_a_dragged_obstacle_is_one_shape_with_a_track(dragged: Recording) -> None:
    page = Replay(dragged).html()
    assert page.count("<title>crate</title>") == 1
    (data,) = re.findall(r"^const D = (.*);$", page, re.MULTILINE)
    crate = json.loads(data)["obstacles"][0]
    assert (crate["since"], crate["until"]) == (0.0, None)
    assert (crate["track"][0][0], crate["track"][0][-1]) == (2.0, 3.0)


def test_the_replay_of_an_unrepeatable_run_says_why(crash: Recording) -> None:
    unrepeatable = replace(crash, unrepeatable="Not repeatable: <wind> blew.")
    assert '<p class="note">Not repeatable: &lt;wind&gt; blew.</p>' in Replay(unrepeatable).html()
    assert 'class="note"' not in Replay(crash).html()


def test_the_replay_is_self_contained_and_makes_no_network_request(cart: Recording) -> None:
    page = Replay(cart).html()
    assert set(re.findall(r"https?://[^\"' <]+", page)) == {"http://www.w3.org/2000/svg"}
    assert not re.search(r"<link|<img|src=|import\(|fetch\(|\{\{", page)
    assert len(page) < 200_000


def test_the_replay_escapes_names() -> None:
    nasty = "</script><script>alert(1)</script>"
    simulator = Simulator(World(name=nasty, obstacles=(Box((2.0, 0.0), (0.2, 0.2), name=nasty),)))
    page = Replay(drive(simulator, lambda _: Twist(0.5, 0.0), 5.0)).html()
    assert "alert(1)</script>" not in page
    assert page.count("<script>") == 1


def test_in_a_notebook_the_replay_is_in_an_iframe(cart: Recording) -> None:
    output = Replay(cart)._repr_html_()
    assert output.startswith('<iframe sandbox="allow-scripts"')
    assert "<script>" not in output


@pytest.mark.slow  # a browser
def test_the_replay_plays_in_a_browser(cart: Recording, tmp_path: Path) -> None:
    """Opened at 4 s, the page shows robot and cart at their positions then."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no chromium: install it to test the page in a browser")
    Replay(cart).save(tmp_path / "page.html")
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}", "--dump-dom"]
    url = (tmp_path / "page.html").as_uri() + "#4"
    page = subprocess.run([*command, url], capture_output=True, text=True, timeout=120, check=True).stdout
    assert "4.00 s" in re.search(r"<output[^>]*>([^<]*)", page)[1]
    index = round(4.0 / 0.05)
    assert f"translate({cart.x[index]:.3f}".rstrip("0") in page
    assert re.search(r'<g id="o\d+" transform="translate\(0,1\.\d+\)"', page)
