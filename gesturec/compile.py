"""From a model's text to its artifact: the compiler's table of contents.

In: a path or a `Source`, and settings. Out: an `Artifact` (or the `Model` that users hold), or `ModelError`
with every finding. Each stage's product is data that `gesturec dump` prints.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

from gesturec.artifact.artifact import Artifact
from gesturec.diagnostics.diagnostic import Diagnostic
from gesturec.diagnostics.errors import ModelError
from gesturec.diagnostics.rules import severity
from gesturec.diagnostics.source import Source
from gesturec.expansion.limits import DEFAULT_LIMITS, Limits

if TYPE_CHECKING:
    from gesturec.model import Model

ModelSource = str | os.PathLike[str] | Source


class Compilation(NamedTuple):
    """What a compile gives: the artifact (None where there are errors) and every finding, sorted by place."""

    artifact: Artifact | None
    findings: tuple[Diagnostic, ...]


def compile_model(
    source: ModelSource,
    set: Mapping[str, object] | None = None,
    profile: str | os.PathLike[str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Model:
    """Compile a model.

    Parameters
    ----------
    source
        Path of a `.yaml` file, or its text as a `Source`.
    set
        Values of parameters, as text in the author's units or as numbers.
    profile
        Path of a person's profile, in YAML: values of parameters, and what `gesturec fit` found of the body.
    limits
        What the compile may take.

    Raises
    ------
    ModelError
        With every finding, where one of them is an error.
    """
    from gesturec.model import Model

    artifact, findings = compile_stages(source, set, profile, limits)
    if artifact is None:
        raise ModelError(findings)
    return Model(artifact, tuple(finding for finding in findings if severity(finding.rule) == "warning"))


def compile_artifact(
    source: ModelSource,
    set: Mapping[str, object] | None = None,
    profile: str | os.PathLike[str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Artifact:
    """As `compile_model`, without the facade."""
    return compile_model(source, set, profile, limits).artifact


def findings_of(
    source: ModelSource,
    set: Mapping[str, object] | None = None,
    profile: str | os.PathLike[str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> tuple[Diagnostic, ...]:
    """Every finding about a model, sorted by place; none means that it compiles without a word."""
    try:
        *_, (_, _, findings) = iterate_stages(source, set, profile, limits, only_findings=True)
        return findings
    except ModelError as error:
        return error.diagnostics


def compile_stages(
    source: ModelSource,
    set: Mapping[str, object] | None = None,
    profile: str | os.PathLike[str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Compilation:
    """Run all stages as far as they go; ModelError only where there is no text to speak of."""
    *_, (_, product, findings) = iterate_stages(source, set, profile, limits)
    return Compilation(product if isinstance(product, Artifact) else None, findings)


def iterate_stages(
    source: ModelSource,
    set: Mapping[str, object] | None = None,
    profile: str | os.PathLike[str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
    only_findings: bool = False,
) -> Iterator[tuple[str, object, tuple[Diagnostic, ...]]]:
    """Each stage's name, product and all findings so far; ends after a stage with errors.

    With `only_findings` the artifact is made only where a profile speaks of it.
    """
    from gesturec.checks.check import resolve_model
    from gesturec.expansion.expand import expand_model, find_tables
    from gesturec.language.load import load_model
    from gesturec.lowering.lower import lower_body

    model = load_model(source, limits)
    yield "model", model, model.findings
    body, found = resolve_model(model, dict(set or {}), profile, limits)
    findings = found.sorted()
    if has_errors(findings):
        yield "body", None, findings
        return
    lowered = lower_body(body)
    yield "lowered", lowered, findings
    if only_findings and profile is None:
        yield "tables", None, sorted_findings((*findings, *find_tables(lowered, limits).findings))
        return
    artifact, more = expand_model(lowered, limits)
    if artifact is not None and profile is not None:
        artifact, told = with_body(artifact, profile, limits)
        more = (*more, *told)
    yield "tables", artifact, sorted_findings((*findings, *more))


def with_body(artifact: Artifact, profile: str | os.PathLike[str], limits: Limits = DEFAULT_LIMITS) -> Compilation:
    """The artifact with the body of a profile's person, and what is wrong with the profile."""
    from gesturec.language.findings import Findings
    from gesturec.profile.apply import apply_profile

    findings = Findings(limits)
    applied = apply_profile(artifact, profile, findings)
    return Compilation(applied, findings.sorted())


def has_errors(findings: tuple[Diagnostic, ...]) -> bool:
    """Whether any finding is an error."""
    return any(severity(finding.rule) == "error" for finding in findings)


def sorted_findings(findings: tuple[Diagnostic, ...]) -> tuple[Diagnostic, ...]:
    """Findings by file and place, those without a place first."""

    def place(finding: Diagnostic) -> tuple[str, int]:
        return ("", 0) if finding.span is None else (finding.span.source.name, finding.span.start)

    return tuple(sorted(findings, key=place))
