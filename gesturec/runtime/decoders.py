"""The decoder of each machine, by name: `nearest`, or the window's recursion over a semiring."""

from __future__ import annotations

from gesturec.runtime.body import Body
from gesturec.runtime.chain import GraphChain, LatticeChain
from gesturec.runtime.lattice import Lattice, machine_lattice
from gesturec.runtime.machines import Decoder
from gesturec.runtime.nearest import Nearest
from gesturec.runtime.options import Options
from gesturec.runtime.reach import Graph
from gesturec.runtime.semiring import SEMIRINGS, Semiring
from gesturec.runtime.starting import start_masks
from gesturec.runtime.window import WindowDecoder


def make_decoders(body: Body, options: Options) -> tuple[Decoder, ...]:
    """One decoder a machine."""
    firsts = start_masks(body.artifact, options.start)
    machines = list(zip(body.machines, body.graphs, body.levers, firsts, strict=True))
    if options.decoder == "nearest":
        return tuple(
            Nearest(tables, graph, lever, first, options.sure, options.growing)
            for tables, graph, lever, first in machines
        )
    ring = SEMIRINGS[options.decoder]
    lattices = [machine_lattice(body.artifact, body.chain, tables) for tables in body.machines]
    chains = [_chain(lattice, graph, ring) for lattice, (_, graph, _, _) in zip(lattices, machines, strict=True)]
    return tuple(
        WindowDecoder(tables, chain, lever, first, options.sure)
        for chain, (tables, _, lever, first) in zip(chains, machines, strict=True)
    )


def _chain(lattice: Lattice, graph: Graph, ring: Semiring) -> LatticeChain | GraphChain:
    return LatticeChain(lattice, ring) if lattice.axes else GraphChain(lattice, ring, graph)
