"""A machine's graph as a picture or for another tool: a compiled model in, text out.

`svg` is laid out from the model's own coordinates (`layout`); `dot`, `graphml` and `json` carry those places along,
`mmd` and `scxml` are the bare automaton. Names are escaped in every format, and states have ids of their own (`s17`),
as names like `45/60/30` are none in most of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from gesturec.diagnostics.errors import GesturecError, LimitError
from gesturec.view.graph_svg import graph_svg
from gesturec.view.graph_text import graph_dot, graph_graphml, graph_json, graph_mermaid, graph_scxml

if TYPE_CHECKING:
    from gesturec.artifact.artifact import Artifact

# Transitions that are written into one file: 2 million are some 100 MB of GraphML. A picture draws the nearest alone
MOST_TRANSITIONS: Final = 2_000_000

FORMATS: Final[Mapping[str, Callable[[Artifact, int], str]]] = {
    "svg": graph_svg,
    "dot": graph_dot,
    "graphml": graph_graphml,
    "mmd": graph_mermaid,
    "scxml": graph_scxml,
    "json": graph_json,
}


def draw_graph(artifact: Artifact, machine: int | str, format: str) -> str:
    """The graph of a machine.

    Parameters
    ----------
    artifact
        The model.
    machine
        Its id or name.
    format
        A key of `FORMATS`.

    Raises
    ------
    GesturecError
        For a machine or format that is not there.
    LimitError
        For more states or transitions than a file should have.
    """
    number = machine_id(artifact, machine)
    if format not in FORMATS:
        raise GesturecError(f"no graph format `{format}`; there are {', '.join(FORMATS)}")
    count = len(artifact.machine(number).transition_target)
    if count > MOST_TRANSITIONS and format != "svg":
        raise LimitError(
            f"{count:,} transitions; a graph's file has at most {MOST_TRANSITIONS:,}: draw it as .svg, which shows "
            "those of one joint by one level alone, or choose another machine"
        )
    return FORMATS[format](artifact, number)


def machine_id(artifact: Artifact, machine: int | str) -> int:
    """Id of a machine from its id or name."""
    names = artifact.manifest.machines
    if isinstance(machine, str):
        if machine in names:
            return names.index(machine)
    elif 0 <= machine < len(names):
        return machine
    known = f"there are {', '.join(names)}" if names else "the body is rigid and has none"
    raise GesturecError(f"no machine `{machine}`; {known}")
