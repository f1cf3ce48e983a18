"""Random URDF trees keep their kinematics, whatever branches, rigid joints, couplings and cuts they have."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gesturec.diagnostics.errors import InputError
from gesturec.scaffold.new import model_from_file

from . import forward
from .test_kinematics import assert_same_places, from_source


def robot(seed: int, n_joint: int, *, chain: bool = False) -> str:
    """A random tree: every joint hangs from an earlier link, some follow an earlier joint."""
    random = np.random.default_rng(seed)
    parts = [f'<link name="l{k}"/>' for k in range(n_joint + 1)]
    moving: list[int] = []
    for k in range(n_joint):
        kind = str(random.choice(["revolute", "prismatic", "continuous", "fixed"], p=[0.5, 0.15, 0.15, 0.2]))
        at, rpy = random.uniform(-0.3, 0.3, 3), random.uniform(-3, 3, 3) * random.integers(0, 2, 3)
        axis = random.normal(size=3) if random.random() < 0.5 else np.eye(3)[random.integers(0, 3)]
        parent = k if chain else int(random.integers(max(0, k - 3), k + 1))
        mimic = ""
        if kind in ("revolute", "prismatic") and moving and random.random() < 0.35:
            near = moving[-2:] if chain else moving  # couplings across a whole chain would leave no place to cut it
            other, factor, offset = random.choice(near), random.normal(), random.normal() * random.integers(0, 2)
            mimic = f'<mimic joint="j{other}" multiplier="{factor}" offset="{offset}"/>'
        if kind != "fixed":
            moving.append(k)
        parts.append(
            f'<joint name="j{k}" type="{kind}"><parent link="l{parent}"/><child link="l{k + 1}"/>'
            f'<origin xyz="{at[0]} {at[1]} {at[2]}" rpy="{rpy[0]} {rpy[1]} {rpy[2]}"/>'
            f'<axis xyz="{axis[0]} {axis[1]} {axis[2]}"/><limit lower="-1.3" upper="0.9"/>{mimic}</joint>'
        )
    return "<robot>\n" + "\n".join(parts) + "\n</robot>"


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 10_000), st.integers(1, 7))
def test_a_random_robot_moves_as_its_source_or_names_its_coupling(tmp_path: Path, seed: int, n_joint: int) -> None:
    text = robot(seed, n_joint)
    values = dict(
        zip((f"j{k}" for k in range(n_joint)), np.random.default_rng(seed).uniform(-1, 1, n_joint), strict=True)
    )
    try:
        artifact = from_source(tmp_path, text, "urdf")
    except InputError as error:  # nothing else may be wrong with it
        assert "no one chain of joints has both" in str(error)
        return
    assert_same_places(artifact, values, forward.urdf_links(text, values))


@pytest.mark.parametrize("seed", [1, 2])
def test_a_long_chain_is_cut_into_limbs_that_stay_small(tmp_path: Path, seed: int) -> None:
    text = robot(seed, 20, chain=True)
    artifact = from_source(tmp_path, text, "urdf")
    assert len(artifact.manifest.machines) > 1
    assert max(map(len, artifact.manifest.states.values())) <= 5000
    values = {f"j{k}": 0.1 * k - 1 for k in range(20)}
    assert_same_places(artifact, values, forward.urdf_links(text, values))


def test_two_thousand_joints_take_a_moment_and_more_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "long.urdf"
    path.write_text(robot(3, 1500, chain=True))
    assert model_from_file("long", path, "urdf").count("joint: ") > 1000
    path.write_text(robot(3, 4000, chain=True))
    with pytest.raises(InputError, match="more than 2000 moving joints"):
        model_from_file("long", path, "urdf")
