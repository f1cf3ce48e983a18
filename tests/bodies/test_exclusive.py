"""`exclusive` of several bodies: each file's list acts on the machines and roots of its own bodies, and no others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.bodies import run_of
from gesturec.artifact.store import load, save
from gesturec.artifact.validate import validate
from gesturec.compile import compile_artifact, findings_of
from gesturec.diagnostics.errors import ArtifactError
from gesturec.runtime.bodies import BodiesSession
from gesturec.runtime.coupling import Exclusive, exclusive_of
from gesturec.runtime.decode import decode
from gesturec.runtime.session import Session
from gesturec.simulate.simulation import SimulateOptions, simulate
from tests.bodies.arms import ARM, written

ARM_ALONE = "transitions: {exclusive: [motion, lower, upper]}\n"
PAIR_ALONE = "transitions: {exclusive: [left.lower, right.lower]}\n"
PEOPLE_ALONE = "transitions: {exclusive: [motion, anna.left.upper, ben.left.upper]}\n"

# machines of people: anna.left.lower, anna.left.upper, anna.right.lower, anna.right.upper, and those of ben
ANNA, BEN = range(4), range(4, 8)


def people_of(folder: Path, arm: str = "", pair: str = "", people: str = "") -> Artifact:
    """Two pairs of arms, whose files say something more."""
    written(folder, pair, people)
    (folder / "arm.yaml").write_text(ARM + arm)
    return compile_artifact(folder / "people.yaml")


@pytest.fixture(scope="module")
def people(tmp_path_factory: pytest.TempPathFactory) -> Artifact:
    return people_of(tmp_path_factory.mktemp("exclusive"), ARM_ALONE, PAIR_ALONE, PEOPLE_ALONE)


def test_each_file_speaks_of_its_own_machines(people: Artifact) -> None:
    found = exclusive_of(people)
    arms = {(0, 1), (2, 3), (4, 5), (6, 7)}
    assert set(found.one_of) == arms | {(0, 2), (4, 6)} | {(1, 5)}
    assert found.of_motion == set(ANNA) | set(BEN)


@pytest.mark.parametrize(
    ("pair", "held", "groups"),
    [
        ("[motion, deformation]", {*ANNA, *BEN}, set()),
        ("[motion, left.upper]", {1, 5}, set()),
        ("[left.lower, left.upper, right.lower]", set(), {(0, 1, 2), (4, 5, 6)}),
    ],
)
def test_a_file_of_bodies_within_another(
    tmp_path: Path, pair: str, held: set[int], groups: set[tuple[int, ...]]
) -> None:
    people = people_of(tmp_path, pair=f"transitions: {{exclusive: {pair}}}\n")
    assert exclusive_of(people) == Exclusive(frozenset(held), tuple(sorted(groups)))
    assert people.manifest.exclusive == ()
    assert not [finding.rule for finding in findings_of(tmp_path / "people.yaml") if "exclusive" in finding.message]


def test_only_one_of_two_inner_bodies_is_meant(tmp_path: Path) -> None:
    folder = written(tmp_path)
    (folder / "alone.yaml").write_text(ARM + ARM_ALONE)
    text = (folder / "pair.yaml").read_text().replace("left: {model: arm.yaml", "left: {model: alone.yaml")
    (folder / "pair.yaml").write_text(text)
    pair = compile_artifact(folder / "pair.yaml")
    assert exclusive_of(pair) == Exclusive(frozenset({0, 1}), ((0, 1),))
    left, right = BodiesSession(pair).parts
    assert left.body.exclusive == Exclusive(frozenset({0, 1}), ((0, 1),))
    assert right.body.exclusive == Exclusive()


def test_each_body_hears_what_is_its_own_and_the_whole_what_spans_bodies(people: Artifact) -> None:
    session = Session(people)
    assert isinstance(session, BodiesSession)
    for part in session.parts:
        assert part.body.exclusive == Exclusive(frozenset({0, 1}), ((0, 1),))
    assert set(session._spanning.exclusive.one_of) == {(0, 2), (4, 6), (1, 5)}
    assert session._spanning.exclusive.of_motion == frozenset()


def test_it_is_kept_in_the_file(people: Artifact, tmp_path: Path) -> None:
    save(people, tmp_path / "people.gcm")
    again = load(tmp_path / "people.gcm")
    assert again.manifest == people.manifest
    assert exclusive_of(again) == exclusive_of(people)


def test_a_file_from_before_has_no_lists_of_files_between(people: Artifact) -> None:
    bodies = tuple({key: value for key, value in body.items() if key != "above"} for body in people.manifest.bodies)
    before = replace(people.manifest, bodies=bodies)
    validate(before, people.columns)
    assert (0, 2) not in exclusive_of(Artifact(before, people.columns)).one_of


@pytest.mark.parametrize("above", [None, ["left"], [[1]]])
def test_lists_that_are_none_are_refused(people: Artifact, above: object) -> None:
    first, *others = people.manifest.bodies
    with pytest.raises(ArtifactError, match="malformed"):
        validate(replace(people.manifest, bodies=({**first, "above": above}, *others)), people.columns)


@pytest.mark.parametrize("options", [{"decoder": "viterbi", "lag": 0.2}, {"decoder": "forward", "lag": 0.0}])
def test_bodies_that_nothing_joins_are_decoded_as_each_alone(tmp_path: Path, options: dict[str, object]) -> None:
    """Both move two limbs at once, against what their own file says, so that what it says makes a difference."""
    folder = written(tmp_path)
    take = simulate(
        compile_artifact(folder / "pair.yaml"),
        SimulateOptions(path=("both_flat", "right.steep", "left.steep"), duration=1.2, noise=0.004, seed=3, apart=0.4),
    ).recording
    alone_path = folder / "arm.yaml"
    alone_path.write_text(ARM + ARM_ALONE)
    pair = compile_artifact(folder / "pair.yaml")
    whole = decode(pair, take, noise=0.004, scale=1.0, **options)
    for body in pair.manifest.bodies:
        name = body["name"]
        own = [place for place, token in enumerate(take.names) if token.startswith(f"{name}.")]
        names = tuple(take.names[place].removeprefix(f"{name}.") for place in own)
        single = compile_artifact(alone_path, set={"side": "left"} if name == "left" else {})
        found = decode(
            single, replace(take, names=names, points=take.points[:, own]), noise=0.004, scale=1.0, **options
        )
        np.testing.assert_array_equal(whole.state[:, run_of(body, "machines")], found.state)
        states = sum(len(each) for each in single.manifest.states.values())
        first = 0 if name == "left" else states
        np.testing.assert_array_equal(whole.probability[:, first : first + states], found.probability)


def test_what_an_inner_file_says_changes_what_is_believed(tmp_path: Path) -> None:
    """A hidden arm stays where it was while the other, of the same pair, is seen to move."""
    folder = written(tmp_path)
    take = simulate(
        compile_artifact(folder / "people.yaml"),
        SimulateOptions(path=("all_flat", "anna.right.steep"), duration=1.0, noise=0.001, seed=1, apart=0.4),
    ).recording
    points = take.points.copy()
    hidden = [place for place, token in enumerate(take.names) if token.endswith("left.lower.tip")]
    points[6:, hidden] = np.nan
    moved = {}
    for said in ("", PAIR_ALONE):
        people = people_of(tmp_path, pair=said)
        decoding = decode(people, replace(take, points=points), noise=0.001, scale=1.0, lag=0.0)
        starts = np.cumsum([0, *[len(people.manifest.states[m]) for m in people.manifest.machines]])
        moved[said] = [1 - float(decoding.probability[14, starts[m]]) for m in (0, 4)]
    assert moved[PAIR_ALONE][0] < 0.85 * moved[""][0]  # both hold what is doubted of any hidden limb
    assert moved[PAIR_ALONE][1] == pytest.approx(moved[""][1], abs=0.02)  # ben's right arm does not move
