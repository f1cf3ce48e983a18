"""The heat map: every pair in its class, the nearest ones by name."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from gesturec.view.separation_svg import nearest_pairs, separation_svg

SVG = "{http://www.w3.org/2000/svg}"
PLACES = np.array([0.0, 0.0, 1.5, 9.0])
SEPARATION = np.abs(PLACES[:, None] - PLACES[None])


def squares(root: ElementTree.Element) -> dict[str, int]:
    return {path.attrib["fill"]: path.attrib["d"].count("M") for path in root.iter(f"{SVG}path")}


def test_every_pair_has_a_square_and_the_diagonal_none() -> None:
    root = ElementTree.fromstring(separation_svg(("a", "b", "c", "d"), SEPARATION, "t"))
    # equal: a b; below 2: c with a and b; above 6: d with all; each twice
    assert sorted(squares(root).values()) == [2, 4, 6]


def test_the_nearest_pairs_are_listed_first() -> None:
    assert nearest_pairs(SEPARATION)[:3] == [(0, 1), (0, 2), (1, 2)]
    text = separation_svg(("a", "b", "c", "d"), SEPARATION, "t")
    assert text.index("a · b") < text.index("a · c") < text.index("b · c")


def test_hostile_names_and_no_states_are_well_formed() -> None:
    root = ElementTree.fromstring(separation_svg(("</svg><script>", "&\x00"), np.zeros((2, 2)), "<t>", "<n>"))
    assert not list(root.iter(f"{SVG}script"))
    ElementTree.fromstring(separation_svg((), np.zeros((0, 0)), "t"))


def test_two_hundred_states_stay_small() -> None:
    places = np.random.default_rng(3).normal(0, 5, 200)
    text = separation_svg(tuple(map(str, range(200))), np.abs(places[:, None] - places[None]), "t")
    assert len(text) < 1_500_000
