"""`gesturec info FILE`: facts of a model or of a recording."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gesturec.cli.models import add_model_options, is_model, load_artifact
from gesturec.cli.recordings import add_recording_options, read_recording
from gesturec.cli.usage import counted


def add_arguments(parser: ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("file", metavar="FILE", help="a model (.yaml, .gcm, a shipped name) or a recording")
    add_model_options(parser)
    add_recording_options(parser)
    parser.add_argument("--json", action="store_true", help="as JSON")


def run(options: Namespace) -> int:
    """Print the facts."""
    if is_model(options.file):
        facts, show = model_facts(load_artifact(options.file, options)), _show_model
    else:
        from gesturec.recordings.facts import recording_facts

        facts, show = recording_facts(read_recording(options.file, options)), _show_recording
    print(json.dumps(facts, indent=2, ensure_ascii=False) if options.json else show(facts))
    return 0


def model_facts(artifact: Any) -> dict[str, Any]:
    """What `info --json` says of a model."""
    manifest = artifact.manifest
    return {
        "name": manifest.name,
        "description": manifest.description,
        "digest": manifest.digest,
        "units": dict(manifest.units),
        "machines": [_machine_facts(artifact, machine) for machine in range(artifact.n_machine)],
        **({"bodies": [body["name"] for body in manifest.bodies]} if manifest.bodies else {}),
        "tokens": list(manifest.tokens),
        "joints": list(manifest.joints),
        "poses": list(manifest.poses),
        "gestures": [gesture.get("name") for gesture in manifest.gestures],
        "bindings": [binding["name"] for binding in manifest.bindings],
        "constraints": list(manifest.constraints),
        "relations": list(manifest.relations),
        "parameters": dict(manifest.parameters),
        "report": dict(manifest.report),
        "bytes": sum(column.nbytes for column in artifact.columns.values()),
    }


def _machine_facts(artifact: Any, machine: int) -> dict[str, Any]:
    """One machine's counts."""
    manifest, tables = artifact.manifest, artifact.machine(machine)
    return {
        "name": tables.name,
        "kind": tables.kind,
        "step": tables.step,
        "states": len(tables.state_names),
        "transitions": len(tables.transition_target),
        "joints": [manifest.joints[joint] for joint in tables.joints],
        "tokens": [manifest.tokens[token] for token in tables.tokens],
    }


def _show_model(facts: dict[str, Any]) -> str:
    """A model's facts as text."""
    lines = [f"{facts['name']}  {facts['description']}".rstrip(), f"digest {facts['digest']}", ""]
    rows = [("machine", "kind", "step", "states", "transitions", "joints")]
    for machine in facts["machines"]:
        joints = ", ".join(joint.removeprefix(f"{machine['name']}.") for joint in machine["joints"])
        counts = (f"{machine['states']:,}", f"{machine['transitions']:,}")
        rows.append((machine["name"], machine["kind"], machine["step"], *counts, joints))
    lines += table(rows)
    lines.append("")
    for name in ("bodies", "tokens", "poses", "gestures", "bindings", "constraints", "relations"):
        if facts.get(name):
            lines.append(f"{len(facts[name])} {name}: {', '.join(map(str, facts[name]))}")
    return "\n".join([*lines, f"{facts['bytes']:,} bytes of tables"])


def _show_recording(facts: dict[str, Any]) -> str:
    """A recording's facts as text."""
    lines = [
        facts["name"],
        f"{counted(facts['frames'], 'frame')}, {counted(len(facts['points']), 'point')}, {facts['duration']:.6g} s",
    ]
    rate = "unknown" if facts["rate"] is None else f"{facts['rate']:.6g} Hz"
    lines.append(f"rate {rate}, up {facts['up'] or 'not stated'}")
    lines.append(_show_times(facts["times"]))
    lines.append("")
    rows = [("point", "seen", "gaps", "longest gap (s)")]
    for point in facts["points"]:
        rows.append((point["name"], f"{point['seen']:.1%}", str(point["gaps"]), f"{point['longest_gap']:.3g}"))
    return "\n".join(lines + table(rows) + [f"note: {note}" for note in facts["notes"]])


def _show_times(times: dict[str, Any]) -> str:
    """How regular the times are, in a line."""
    if times["repeated"] or times["backward"] or times["missing"]:
        fault = f"{times['repeated']} repeated, {times['backward']} backward, {times['missing']} missing"
        return f"times: {fault} (their frames are refused when decoding)"
    if times["shortest"] is None:
        return "times: one frame"
    return f"times rise by {times['shortest']:.4g} to {times['longest']:.4g} s"


def table(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Rows as columns of text, numbers to the right."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            cell.rjust(width) if cell[:1].isdigit() else cell.ljust(width)
            for cell, width in zip(row, widths, strict=True)
        ]
        lines.append("  ".join(cells).rstrip())
    return lines


def shown_name(path: str | Path) -> str:
    """What a file is called in a summary."""
    return Path(path).name or str(path)
