"""The page on phones and for long takes: nothing to the side, nothing that cannot be seen, no press that is lost."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.status import STATUS_ID
from gesturec.view.page import render_page

TOO_WIDE = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
RECTS = "document.querySelectorAll('#ribbon rect:not(.lane)').length"
LONG = 10_000
MOST_RECTS = 8_000
"""Of six rows of 1.5 px a stretch at 1280 px, and as many runs again that are longer."""


@pytest.fixture
def sized(browser: Any) -> Iterator[Any]:
    """Make the window so wide; afterwards it is as it was."""

    def resize(width: int) -> None:
        browser.send("Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=1, mobile=True)

    yield resize
    browser.send("Emulation.clearDeviceMetricsOverride")


@pytest.mark.parametrize("width", [320, 360, 480, 800, 1280])
def test_no_page_scrolls_sideways(hand: Artifact, make_take: Any, opened: Any, sized: Any, width: int) -> None:
    sized(width)
    page = opened(render_page(hand, make_take(hand, 40, undecided=slice(10, 20)), "walk_" * 20))
    assert page.run(TOO_WIDE) == 0
    for part in ("scene", "graph-box", "ribbon", "why", "slider"):
        left, right, high = page.run(
            f"(() => {{ const b = document.getElementById('{part}').getBoundingClientRect();"
            " return [b.left, b.right, b.height]; })()"
        )
        assert 0 <= left < right <= width and high > 0, part


def test_a_finger_scrolls_the_page_where_it_is_one_column(
    hand: Artifact, make_take: Any, opened: Any, sized: Any
) -> None:
    sized(360)
    page = opened(render_page(hand, make_take(hand, 40), "walk"))
    assert page.run("getComputedStyle(canvas).touchAction") == "pan-y"
    assert page.run("getComputedStyle(document.querySelector('#ribbon svg')).touchAction") == "pan-y"


def test_a_graph_that_found_no_room_is_whole_once_there_is_some(
    hand: Artifact, make_take: Any, opened: Any, sized: Any
) -> None:
    sized(1280)
    page = opened(render_page(hand, make_take(hand, 40), "walk"), "#machine=thumb")
    shown = "document.querySelector('#graph-box svg').getAttribute('viewBox')"
    resized = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
    page.run(f"document.getElementById('graph').style.height = '60px'; {resized}")
    small = page.run(shown)
    page.run(f"document.getElementById('graph').style.height = ''; {resized}")
    assert page.run(shown) != small
    assert page.run("document.getElementById('graph-caption').textContent.startsWith('around')") is False


def test_a_slices_button_keeps_the_focus_when_the_frame_changes(hand: Artifact, make_take: Any, opened: Any) -> None:
    page = opened(render_page(hand, make_take(hand, 40), "walk"))
    page.run("document.querySelector('#panels button:last-child').focus()")
    page.press("ArrowRight")
    page.run("document.activeElement.click()")
    assert page.run("document.activeElement.getAttribute('aria-pressed')") == "true"


@pytest.mark.parametrize(("there", "back"), [("a", "d"), ("w", "s"), ("q", "e")])
def test_keys_turn_the_body_and_turn_it_back(
    hand: Artifact, make_take: Any, opened: Any, there: str, back: str
) -> None:
    page = opened(render_page(hand, make_take(hand, 40), "walk"))
    ink = "canvas.toDataURL()"
    first = page.run(ink)
    page.press(there)
    assert page.run(ink) != first
    page.press(back)
    assert page.run(ink) == first


def test_a_long_take_has_no_more_stretches_than_can_be_seen_and_all_that_is_wrong(
    hand: Artifact, make_take: Any, opened: Any
) -> None:
    take = make_take(hand, LONG)
    state, status = take.state.copy(), take.status.copy()
    state[LONG // 2], status[LONG // 2] = -1, STATUS_ID["misfit"]
    bad = {name: why._replace(status="misfit") for name, why in take.why[0].items()}
    whys = (*take.why[: LONG // 2], bad, *take.why[LONG // 2 + 1 :])
    page = opened(render_page(hand, dataclasses.replace(take, state=state, status=status, why=whys), "long"))
    assert page.run("Number(document.getElementById('slider').max)") == LONG - 1
    assert page.run(RECTS) < MOST_RECTS
    wrong = page.run("document.querySelectorAll('#ribbon rect.misfit').length")
    assert wrong == len(hand.manifest.machines)


def test_a_short_take_has_every_stretch(hand: Artifact, make_take: Any, opened: Any) -> None:
    take = make_take(hand, 60)
    page = opened(render_page(hand, take, "short"))
    runs = sum(int(np.count_nonzero(np.diff(column))) + 1 for column in take.state.T)
    assert page.run(RECTS) >= runs
