"""The model with a person's body: token tables made anew, states and transitions kept.

In: an artifact and a profile that was read for it. Out: the artifact with the person's chain, tables and noise and
the costs of transitions; or findings, at their places, where the profile speaks of what this model does not have.
Of several bodies each may have a profile, which speaks of it by the names of its own model; a profile of one body is
for all of those that it was made for.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.artifact import Artifact
from gesturec.artifact.bake import rebake
from gesturec.artifact.bodies import body_artifacts, with_parts
from gesturec.artifact.kinematics import rotation_about
from gesturec.diagnostics.errors import ArtifactError
from gesturec.diagnostics.suggest import did_you_mean
from gesturec.language.findings import Findings
from gesturec.profile.profile import Profile, Vector
from gesturec.profile.read import Located, read_profiles

Array = NDArray[np.float64]


def apply_profile(artifact: Artifact, path: str | os.PathLike[str], findings: Findings) -> Artifact | None:
    """The artifact for the person of a profile's file; None after a finding that is an error."""
    names = tuple(body["name"] for body in artifact.manifest.bodies)
    read = read_profiles(path, names, findings)
    if read is None or findings.errors():
        return None
    if not names:
        assert isinstance(read, Located)
        return applied(artifact, read, "", findings)
    given = profiles_by_body(artifact, read, findings) if isinstance(read, Located) else read
    parts = {part.manifest.name: part for part in body_artifacts(artifact)}
    made = {name: applied(parts[name], located, f"{name}.", findings) for name, located in given.items()}
    changed = {name: part for name, part in made.items() if part is not None and part is not parts[name]}
    if findings.errors():
        return None
    return with_parts(artifact, changed) if changed else artifact


def profiles_by_body(artifact: Artifact, located: Located, findings: Findings) -> dict[str, Located]:
    """The one profile for each body whose model it was made for; of parameters alone it is for none."""
    if not has_estimates(located.profile):
        return {}
    digests = {body["name"]: body.get("digest", "") for body in artifact.manifest.bodies}
    found = {name: located for name, digest in digests.items() if digest and digest == located.profile.digest}
    if not found:
        message = f"the profile was made for {made_for(located.profile)}, and of this model's bodies none is that"
        listed = ", ".join(f"{name} {digest[:12] or 'unknown'}" for name, digest in digests.items())
        help = f"they are {listed}; with `bodies: {{NAME: profile}}` a profile says whose it is"
        findings.report("other-model", message, located.places.get(("digest",), located.start), "", help)
    return found


def applied(artifact: Artifact, located: Located, prefix: str, findings: Findings) -> Artifact | None:
    """A body's artifact for the person of a profile, which leaves `prefix` away from its names."""
    if not has_estimates(located.profile):
        return artifact  # parameters alone, which the compiler has taken
    before = findings.n_error
    check_profile(artifact, located, findings, prefix)
    if findings.n_error > before:
        return None
    try:
        return with_profile(artifact, prefixed(located.profile, prefix))
    except (ValueError, ArtifactError) as error:
        findings.report("value-out-of-range", f"the profile makes no body of this model: {error}", located.start)
        return None


def prefixed(profile: Profile, prefix: str) -> Profile:
    """A profile whose names are those of the whole."""
    return replace(
        profile,
        joints={prefix + name: part for name, part in profile.joints.items()},
        tokens={prefix + name: part for name, part in profile.tokens.items()},
        token_noise={prefix + name: value for name, value in profile.token_noise.items()},
        motion={prefix + name: motion for name, motion in profile.motion.items()},
    )


def made_for(profile: Profile) -> str:
    """What a profile was made for, for people."""
    return f"`{profile.model}` with the digest {profile.digest[:12] or 'of none'}"


def has_estimates(profile: Profile) -> bool:
    """Whether a profile says more than parameters."""
    said = (profile.digest, profile.joints, profile.tokens, profile.noise, profile.token_noise, profile.motion)
    return any(said) or profile.scale != 1


def check_profile(artifact: Artifact, located: Located, findings: Findings, prefix: str = "") -> None:
    """Report what the profile says that the model has not."""
    manifest, profile = artifact.manifest, located.profile
    if not profile.digest or profile.digest != manifest.digest:
        whose = f"the model of body `{manifest.name}` has" if prefix else "this model's is"
        message = f"the profile was made for {made_for(profile)}, and {whose} {manifest.digest[:12] or 'none'}"
        help = "fit the recordings again, or compile as then (the same file, the same --set)"
        if profile.model and profile.model != manifest.name:
            help = f"it is of another body; fit recordings of `{manifest.name}`"
        findings.report("other-model", message, located.places.get(("digest",), located.start), "", help)
        return
    joints, tokens, machines = (
        tuple(name.removeprefix(prefix) for name in names)
        for names in (manifest.joints, manifest.tokens, manifest.machines)
    )
    _known(profile.joints, joints, "joint", "unknown-joint", located, findings)
    _known(profile.tokens, tokens, "token", "unknown-token", located, findings)
    _known(profile.token_noise, tokens, "noise", "unknown-token", located, findings)
    _known(profile.motion, machines, "machine", "unknown-machine", located, findings)
    for machine, motion in profile.motion.items():
        if machine in machines:
            tables = artifact.machine(machines.index(machine))
            arcs = {(tables.state_names[s], tables.state_names[t]) for s, t in zip(*_arcs(tables), strict=True)}
            for source, target in sorted(set(motion.costs) - arcs):
                message = f"machine `{machine}` has no transition `{source} -> {target}`"
                findings.report("unknown-state", message, located.places["arc", machine, source, target])


def _known(
    given: Iterable[str], names: tuple[str, ...], kind: str, rule: str, located: Located, findings: Findings
) -> None:
    word = "token" if kind == "noise" else kind
    for name in given:
        if name not in names:
            message = f"the model has no {word} `{name}`"
            findings.report(rule, message, located.places[kind, name], "", did_you_mean(name, names))


def _arcs(tables: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Source and target of every transition of a machine."""
    count = np.diff(tables.transition_start)
    return np.repeat(np.arange(len(count)), count), np.asarray(tables.transition_target)


def with_profile(artifact: Artifact, profile: Profile) -> Artifact:
    """The artifact for a person whose profile fits it."""
    columns, manifest, size = artifact.columns, artifact.manifest, profile.scale

    def places(parts: dict[str, Vector]) -> dict[str, Array]:
        return {name: np.array(at) / (size * manifest.scale) for name, at in parts.items()}

    rest = {}
    for name, part in profile.joints.items():
        if part.turn is not None and any(part.turn):
            rest[name] = columns["joint_rest"][manifest.joints.index(name)] @ turned(np.array(part.turn))
    baked = rebake(
        artifact,
        scale=size * manifest.scale,
        joint_at=places({name: part.at for name, part in profile.joints.items() if part.at is not None}),
        token_at=places({name: part.at for name, part in profile.tokens.items() if part.at is not None}),
        joint_rest=rest,
    )
    changed = {**baked.columns, **_noise(baked, profile), **_costs(baked, profile)}
    for array in changed.values():
        array.flags.writeable = False
    motion = {name: {"hold": m.hold, "move": m.move, "crossing": m.crossing} for name, m in profile.motion.items()}
    told = {"name": profile.name, "scale": size, "noise": profile.noise, "motion": motion}
    # the model's own noise was given, the profile's was measured in other takes: the runtime trusts them differently
    told["noise_of"] = [
        name
        for name, was, now in zip(manifest.tokens, columns["token_noise"], changed["token_noise"], strict=True)
        if np.isnan(was) and np.isfinite(now)
    ]
    return Artifact(replace(baked.manifest, profile=told), changed)


def turned(vector: Array) -> Array:
    """The rotation by a rotation vector, rad."""
    angle = float(np.linalg.norm(vector))
    return np.asarray(rotation_about(vector / angle, angle))


def _noise(artifact: Artifact, profile: Profile) -> dict[str, Array]:
    """Standard deviations of tokens: their own, else the profile's; what the model itself says stays."""
    noise = np.array(artifact.columns["token_noise"])
    given = np.full(len(noise), np.nan if profile.noise is None else profile.noise)
    for name, value in profile.token_noise.items():
        given[artifact.manifest.tokens.index(name)] = value
    return {"token_noise": np.where(np.isfinite(noise), noise, given)}


def _costs(artifact: Artifact, profile: Profile) -> dict[str, Array]:
    """Costs of transitions, added to those of the model."""
    if not any(motion.costs for motion in profile.motion.values()):
        return {}
    columns = artifact.columns
    cost = np.zeros(len(columns["transition_target"]))
    if len(columns["transition_cost"]):
        cost += columns["transition_cost"]
    for machine, name in enumerate(artifact.manifest.machines):
        motion = profile.motion.get(name)
        if motion is None or not motion.costs:
            continue
        tables = artifact.machine(machine)
        first = int(columns["transition_start"][artifact.states(machine).start])
        for arc, (s, t) in enumerate(zip(*_arcs(tables), strict=True)):
            cost[first + arc] += motion.costs.get((tables.state_names[s], tables.state_names[t]), 0.0)
    return {"transition_cost": cost}
