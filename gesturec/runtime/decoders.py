"""The decoder of each machine, by name: `nearest`, or the window's recursion over a semiring."""

from __future__ import annotations

from gesturec.artifact.artifact import MachineTables
from gesturec.runtime.body import Body
from gesturec.runtime.chain import GraphChain, LatticeChain
from gesturec.runtime.curve_chain import CurveChain
from gesturec.runtime.lattice import Lattice, machine_lattice
from gesturec.runtime.machines import Decoder
from gesturec.runtime.nearest import Nearest
from gesturec.runtime.options import Options
from gesturec.runtime.reach import Graph
from gesturec.runtime.semiring import SEMIRINGS, Semiring
from gesturec.runtime.starting import start_masks
from gesturec.runtime.window import WindowDecoder

Chain = LatticeChain | GraphChain | CurveChain


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
    chains = [
        _chain(lattice, tables, graph, ring) for lattice, (tables, graph, _, _) in zip(lattices, machines, strict=True)
    ]
    return tuple(
        WindowDecoder(tables, chain, lever, first, options.sure)
        for chain, (tables, _, lever, first) in zip(chains, machines, strict=True)
    )


def _chain(lattice: Lattice, tables: MachineTables, graph: Graph, ring: Semiring) -> Chain:
    if lattice.axes:
        return LatticeChain(lattice, ring)
    return CurveChain(lattice, ring, tables) if graph.rounds_up else GraphChain(lattice, ring, graph)
