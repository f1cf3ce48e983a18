"""The page in a browser: it starts without a fault, shows what was decoded, and asks the network for nothing."""

from __future__ import annotations

import dataclasses
import json
import re
from typing import Any

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.runtime.step import Decoding
from gesturec.view.page import render_page

LIT = "[...document.querySelectorAll('.node.lit')].map((node) => node.dataset.state)"
FAULT = "document.documentElement.dataset.error || null"
HATCHED = "[...document.querySelectorAll('#ribbon rect.undecided')].map((rect) => rect.getAttribute('fill'))"


def test_the_slider_moves_the_lit_state(hand: Artifact, make_take: Any, opened: Any) -> None:
    take = make_take(hand, 40)
    page = opened(render_page(hand, take, "walk"))
    names = hand.manifest.states[hand.manifest.machines[0]]
    assert page.run(LIT) == [names[take.state[0, 0]]]
    page.run(
        "(() => { const s = document.getElementById('slider'); s.value = 7; s.dispatchEvent(new Event('input')); })()"
    )
    assert page.run(LIT) == [names[take.state[7, 0]]]
    page.press("ArrowRight")
    assert page.run(LIT) == [names[take.state[8, 0]]]


def test_the_arrow_keys_choose_a_machine(hand: Artifact, make_take: Any, opened: Any) -> None:
    page = opened(render_page(hand, make_take(hand, 40), "walk"), "#frame=9")
    page.press("ArrowDown")
    second = hand.manifest.machines[1]
    assert page.run("document.querySelector('.name.chosen').firstChild.data") == second
    assert page.run(LIT) == [hand.manifest.states[second][9]]


def test_a_pose_that_may_hold_is_told_apart_from_one_that_does(hand: Artifact, make_take: Any, opened: Any) -> None:
    take = make_take(hand, 40)
    poses = np.zeros_like(take.poses)
    poses[:, 0], poses[:, 1] = 1, 2
    page = opened(render_page(hand, dataclasses.replace(take, poses=poses), "walk"))
    why = page.run("document.getElementById('why').innerText")
    holds, may = why.index("poses that hold"), why.index("poses that may hold")
    assert holds < why.index(hand.manifest.poses[0]) < may < why.index(hand.manifest.poses[1])


LISTEN = """(() => {
  const paint = CanvasRenderingContext2D.prototype.fillText;
  window.painted = [];
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
    window.painted.push([text, x, y, x + this.measureText(text).width]);
    paint.call(this, text, x, y);
  };
})()"""


def test_every_machines_name_is_in_the_picture_in_every_frame(hand: Artifact, make_take: Any, opened: Any) -> None:
    page = opened(render_page(hand, make_take(hand, 16), "walk"))
    page.run(LISTEN)
    width = page.run("document.getElementById('canvas').clientWidth")
    for frame in range(1, 16):
        page.run("window.painted.length = 0")
        page.press("ArrowRight")
        names = {text: (low, high) for text, low, _, high in page.run("window.painted")}
        for name in hand.manifest.machines:
            assert name in names, frame
            assert names[name][0] >= 0 and names[name][1] <= width


def test_successors_of_the_lit_state_are_marked(hand: Artifact, make_take: Any, opened: Any) -> None:
    page = opened(render_page(hand, make_take(hand, 40), "walk"))
    tables = hand.machine(0)
    start, end = tables.transition_start[:2]
    successors = {tables.state_names[target] for target in tables.transition_target[start:end]} - {
        tables.state_names[0]
    }
    marked = set(page.run("[...document.querySelectorAll('.node.next')].map((node) => node.dataset.state)"))
    # the picture has the slice of the current state alone
    assert marked
    assert marked <= successors


def test_undecided_stretches_are_hatched_and_only_they(hand: Artifact, make_take: Any, opened: Any) -> None:
    page = opened(render_page(hand, make_take(hand, 40, undecided=slice(10, 20)), "walk"), "#frame=12")
    assert page.run(HATCHED) == ["url(#hatch)"] * len(hand.manifest.machines)
    assert page.run(LIT) == []
    assert page.run("document.querySelectorAll('.node.maybe').length") > 0
    assert "one of 29 states" in page.run("document.querySelector('#ribbon text.run.open').textContent")
    page = opened(render_page(hand, make_take(hand, 40), "walk"))
    assert page.run(HATCHED) == []


def test_pointing_at_a_row_says_why_and_clicking_chooses_machine_and_frame(
    hand: Artifact, make_take: Any, opened: Any
) -> None:
    page = opened(render_page(hand, make_take(hand, 40, undecided=slice(10, 20)), "walk"))
    lane = "document.querySelectorAll('#ribbon rect.lane')[1].getBoundingClientRect()"
    left, width, y = page.run(f"(() => {{ const b = {lane}; return [b.left, b.width, b.top + b.height / 2]; }})()")
    hint = "document.getElementById('hint').innerText"
    for frame, said in ((14, "undecided"), (30, "ok: every machine")):
        x = left + width * (frame + 0.5) / 40
        page.send("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        told = page.run(hint)
        assert said in told and "3 of 3 tokens seen, χ² 1.00 of at most 16.0" in told and "9 of 32 states" in told
        page.send("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", buttons=1)
        page.send("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, button="left")
        assert page.run("document.getElementById('machine').selectedOptions[0].textContent") == "middle"
        why = page.run("document.getElementById('why').innerText")
        assert why.startswith(f"frame {frame}") and "middle: " in why and "9 of 32 states" in why
    page.send("Input.dispatchMouseEvent", type="mouseMoved", x=5, y=5)
    assert page.run("document.getElementById('hint').hidden") is True


def test_the_canvas_shows_a_body_that_moves(hand: Artifact, make_take: Any, opened: Any) -> None:
    page = opened(render_page(hand, make_take(hand, 40), "walk"))
    ink = "(() => { const c = document.getElementById('canvas'); return c.toDataURL(); })()"
    first = page.run(ink)
    page.press("End")
    assert page.run(ink) != first


def test_the_pointer_is_told_which_token_it_is_on(hand: Artifact, make_take: Any, opened: Any) -> None:
    page = opened(render_page(hand, make_take(hand, 40), "walk"))
    box = page.run("(() => { const b = canvas.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })()")
    told = set()
    for step in range(1, 60):
        x, y = box[0] + box[2] / 2, box[1] + box[3] * step / 60
        page.send("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        told.add(page.run("document.getElementById('canvas').title").split(",")[0])
    assert told & set(hand.manifest.tokens)
    assert told <= {"", *hand.manifest.tokens}


def test_dragging_turns_the_body_and_reset_turns_it_back(hand: Artifact, make_take: Any, opened: Any) -> None:
    page = opened(render_page(hand, make_take(hand, 40), "walk"))
    ink = "document.getElementById('canvas').toDataURL()"
    first = page.run(ink)
    for kind, x in (("mousePressed", 200), ("mouseMoved", 300), ("mouseReleased", 300)):
        page.send("Input.dispatchMouseEvent", type=kind, x=x, y=250, button="left", buttons=1)
    assert page.run(ink) != first
    page.run("document.getElementById('reset').click()")
    assert page.run(ink) == first


@pytest.mark.parametrize("count", [0, 1])
def test_a_take_of_no_or_one_frame_opens(hand: Artifact, make_take: Any, opened: Any, count: int) -> None:
    page = opened(render_page(hand, make_take(hand, count), "short"))
    assert page.run("document.getElementById('slider').disabled") is True
    page.press(" ")
    page.press("ArrowRight")
    assert page.run(FAULT) is None


def test_a_take_without_any_pose_shows_its_points(hand: Artifact, make_take: Any, opened: Any) -> None:
    take = make_take(hand, 20)
    lost = dataclasses.replace(
        take, pose_rotation=take.pose_rotation * np.nan, pose_translation=take.pose_translation * np.nan
    )
    page = opened(render_page(hand, lost, "lost"))
    assert "no pose" in page.run("document.getElementById('scene-note').textContent")


def test_a_take_with_nothing_known_opens(hand: Artifact, make_take: Any, opened: Any) -> None:
    take = make_take(hand, 20, undecided=slice(None), hidden=slice(None))
    changed = {field: getattr(take, field) * np.nan for field in ("pose_rotation", "pose_translation", "scale", "time")}
    changed["probability"] = take.probability * 0
    page = opened(render_page(hand, dataclasses.replace(take, **changed), "dark"))
    assert page.run("document.querySelectorAll('#ribbon rect.undecided').length") == len(hand.manifest.machines)


def test_a_rigid_body_has_a_page_without_a_graph(opened: Any, make_take: Any, rigid: Artifact) -> None:
    page = opened(render_page(rigid, make_take(rigid, 20), "head"))
    assert "no machine" in page.run("document.getElementById('graph-box').textContent")


def test_no_request_leaves_the_page(hand: Artifact, make_take: Any, opened: Any) -> None:
    text = render_page(hand, make_take(hand, 20), "quiet")
    page = opened(text)
    page.press("End")
    assert [url for url in page.requests if not url.startswith(("file:", "data:", "about:"))] == []
    assert set(re.findall(r"https?://[^\s\"'<>]*", text)) == {"http://www.w3.org/2000/svg"}


def test_hostile_names_are_only_text(hand: Artifact, make_take: Any, opened: Any, rename: Any) -> None:
    nasty = rename(hand, lambda name: f"</script><img src=x onerror=document.title='owned'>{name}&amp;\u2028")
    page = opened(render_page(nasty, make_take(nasty, 12), "</title></script><script>document.title='owned'</script>"))
    assert "owned'</script>" in page.run("document.title")
    assert page.run("document.title").endswith("gesturec")
    assert page.run("document.querySelectorAll('img').length") == 0
    assert page.run("document.scripts.length") == 2


def test_a_policy_forbids_all_but_the_pages_own_code(hand: Artifact, make_take: Any) -> None:
    text = render_page(hand, make_take(hand, 3), "policy")
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    assert policy[1].startswith("default-src 'none'")
    assert "unsafe" not in policy[1]


def test_a_long_take_stays_below_ten_megabytes(hand: Artifact, make_take: Any) -> None:
    text = render_page(hand, make_take(hand, 5000), "long")
    assert len(text) < 10_000_000


def test_frames_are_thinned_out_beyond_the_budget(
    hand: Artifact, make_take: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gesturec.view.payload.POSITION_BUDGET", 20_000)
    take: Decoding = make_take(hand, 1000)
    text = render_page(hand, take, "thin")
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)[1])  # type: ignore[index]
    every = data["frames"]["every"]
    assert every > 1
    assert data["frames"]["count"] == len(range(0, 1000, every))


def test_the_ribbon_shows_a_shorter_stretch_that_follows_the_frame(hand: Artifact, make_take: Any, opened: Any) -> None:
    page = opened(render_page(hand, make_take(hand, 400), "walk"))
    runs = "document.querySelectorAll('#ribbon rect:not(.lane)').length"
    whole = page.run(runs)
    page.press("+")
    page.press("+")
    part = page.run(runs)
    assert part < whole / 2
    page.press("End")
    playhead = page.run("Number(document.querySelector('.playhead').getAttribute('x1'))")
    assert playhead > page.run("document.querySelector('#ribbon').clientWidth") - 30
    page.press("-")
    page.press("-")
    assert page.run(runs) == whole
