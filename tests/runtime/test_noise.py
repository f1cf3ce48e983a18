"""Whose word counts on how noisy a token is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gesturec
from gesturec.profile.apply import with_profile
from gesturec.profile.profile import Profile
from gesturec.runtime.body import lay_out
from gesturec.runtime.noise import own_noise, start_noise

MODEL = """
gesturec: 1
name: arm
units: {length: m, angle: deg}
root:
  name: base
  tokens:
    a: [0, 0, 0]
    b: [0.1, 0, 0]
    c: [0, 0.1, 0]
limbs:
  arm:
    chain:
      - {joint: bend, axis: z, levels: [0, 45, 90]}
      - {token: middle, at: [0.1, 0, 0], noise: 4 mm}
      - {token: tip, at: [0.2, 0, 0]}
"""
MEASURED = 0.001**2 * np.eye(3)


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> gesturec.Model:
    path = Path(tmp_path_factory.mktemp("noise")) / "arm.yaml"
    path.write_text(MODEL, encoding="utf-8")
    return gesturec.compile_model(path)


def deviations(arm: gesturec.Model, profile: Profile | None, given: float | None, measured: bool) -> dict[str, float]:
    """What is used for each token, m."""
    artifact = arm.artifact if profile is None else with_profile(arm.artifact, profile)
    own = lay_out(artifact, None).own_noise
    tokens = artifact.manifest.tokens
    told = np.tile(MEASURED, (len(tokens), 1, 1)) if measured else None
    covariance = start_noise(given, len(tokens)).of_tokens(own, told)
    return dict(zip(tokens, np.sqrt(covariance[:, 0, 0]), strict=True))


def profile_of(arm: gesturec.Model) -> Profile:
    manifest = arm.artifact.manifest
    return Profile(name="p", model=manifest.name, digest=manifest.digest, noise=0.003)


def test_a_profiles_noise_stands_in_for_an_estimate(arm: gesturec.Model) -> None:
    assert deviations(arm, profile_of(arm), None, False)["arm.tip"] == pytest.approx(0.003)


def test_a_recordings_covariance_counts_more_than_a_profile(arm: gesturec.Model) -> None:
    assert deviations(arm, profile_of(arm), None, True)["arm.tip"] == pytest.approx(0.001, rel=0.01)


def test_given_noise_counts_more_than_a_profile(arm: gesturec.Model) -> None:
    assert deviations(arm, profile_of(arm), 0.007, False)["arm.tip"] == pytest.approx(0.007)


@pytest.mark.parametrize("measured", [False, True])
@pytest.mark.parametrize("with_it", [False, True])
def test_what_the_author_gave_a_token_counts_most(arm: gesturec.Model, with_it: bool, measured: bool) -> None:
    profile = profile_of(arm) if with_it else None
    if profile is not None:
        profile = replace(profile, token_noise={"arm.middle": 0.009})
    assert deviations(arm, profile, 0.007, measured)["arm.middle"] == pytest.approx(0.004)


@pytest.mark.parametrize("said", [None, "arm.tip", 3, {"tip": 1}])
def test_whatever_else_a_compiled_file_says_leaves_noise_the_models(said: object) -> None:
    own = own_noise(np.array([0.002, np.nan]), ("tip", "arm"), {"noise_of": said})
    np.testing.assert_array_equal(own.model, [0.002, np.nan])
    assert np.isnan(own.fitted).all()
