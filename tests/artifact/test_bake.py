"""Rebaking equals compiling the other body, and refuses what it cannot do."""

from __future__ import annotations

import numpy as np
import pytest

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.bake import rebake
from gesturec.expansion.expand import expand_model
from gesturec.lowering.lowered import LoweredLimb, LoweredModel
from tests.expansion.bodies import FLEX, MM, SPAN, body, joint, levels, machine, paper_hand, token


def compiled(model: LoweredModel) -> Artifact:
    artifact = expand_model(model).artifact
    assert artifact is not None
    return artifact


def scaled(model: LoweredModel, factor: float) -> LoweredModel:
    """The model with every length times `factor`."""

    def times(vector: tuple[float, float, float]) -> tuple[float, float, float]:
        return tuple(factor * x for x in vector)  # type: ignore[return-value]

    joints = []
    for each in model.joints:
        moved = each._replace(at=times(each.at))
        if each.type == "slide":
            grown = tuple(
                level._replace(value=level.value * factor, low=level.low * factor, high=level.high * factor)
                for level in each.levels
            )
            moved = moved._replace(levels=grown)
        joints.append(moved)
    tokens = tuple(each._replace(at=times(each.at)) for each in model.tokens)
    return model._replace(joints=tuple(joints), tokens=tokens, scale=factor)


def slider() -> LoweredModel:
    joints = [
        joint("arm.turn", 0, 0, (0, 0, 1), **FLEX),
        joint("arm.reach", 0, 1, (1, 0, 0), type="slide", levels=levels((0, 20, 40), 0, 40, MM)),
    ]
    tokens = [token("root", None, 0), token("arm.tip", 0, 2, (10, 0, 0))]
    return body(joints, tokens, [LoweredLimb("arm", 0, 0, SPAN)], [machine("arm", [0], [0, 1])])


@pytest.mark.parametrize("make", [paper_hand, slider])
def test_a_rebaked_size_is_the_size_compiled(make: object) -> None:
    model = make()  # type: ignore[operator]
    again, wanted = rebake(compiled(model), scale=1.15), compiled(scaled(model, 1.15))
    for name, column in wanted.columns.items():
        assert np.allclose(again.columns[name], column, rtol=1e-12, atol=1e-15, equal_nan=True), name
    assert again.manifest.scale == 1.15


def test_a_rebaked_length_moves_what_lies_beyond_it() -> None:
    model = paper_hand()
    pip = next(i for i, each in enumerate(model.joints) if each.name == "index.pip")
    joints = tuple(each._replace(at=(0.045, 0.0, 0.0)) if i == pip else each for i, each in enumerate(model.joints))
    again = rebake(compiled(model), joint_at={"index.pip": (0.045, 0, 0)})
    wanted = compiled(model._replace(joints=joints))
    assert np.allclose(again.machine(0).mean, wanted.machine(0).mean, atol=1e-15)
    assert np.array_equal(again.machine(1).mean, compiled(model).machine(1).mean)


@pytest.mark.parametrize("bad", [{"scale": 0.0}, {"scale": float("nan")}, {"joint_at": {"nose": (0, 0, 0)}}])
def test_what_is_no_body_is_refused(bad: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"."):
        rebake(compiled(paper_hand()), **bad)  # type: ignore[arg-type]
