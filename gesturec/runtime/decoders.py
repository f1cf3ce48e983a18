"""The decoder of each machine, by name: `nearest`, or the window's recursion over a semiring."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gesturec.artifact.artifact import MachineTables
from gesturec.runtime.arrays import Mask
from gesturec.runtime.body import Body
from gesturec.runtime.chain import Chain, Ids
from gesturec.runtime.curve_chain import CURVE_MOTION, CurveChain
from gesturec.runtime.dwell import Ages, ages_of, bounds_of
from gesturec.runtime.graph_chain import GraphChain
from gesturec.runtime.kernels import MotionParameters
from gesturec.runtime.lattice import Lattice, machine_lattice
from gesturec.runtime.lattice_chain import LatticeChain
from gesturec.runtime.machines import Decoder
from gesturec.runtime.nearest import Nearest
from gesturec.runtime.options import Options
from gesturec.runtime.person_motion import person_motion
from gesturec.runtime.posture_filter import PostureFilter
from gesturec.runtime.postures import postures_of
from gesturec.runtime.reach import Graph
from gesturec.runtime.semiring import MAX_PRODUCT, SEMIRINGS, TRACED, Semiring
from gesturec.runtime.starting import start_masks
from gesturec.runtime.window import WindowDecoder


def make_decoders(body: Body, options: Options, noise: float) -> tuple[Decoder, ...]:
    """One decoder a machine, for tokens measured with a standard deviation of `noise`, m."""
    firsts = start_masks(body.artifact, options.start)
    if options.decoder == "nearest":
        return tuple(
            Nearest(tables, graph, lever, first, options.sure, options.growing, _ages(body, tables, None, MAX_PRODUCT))
            for tables, graph, lever, first in zip(body.machines, body.graphs, body.levers, firsts, strict=True)
        )
    return tuple(_window_decoder(body, machine, first, options, noise) for machine, first in enumerate(firsts))


def make_postures(body: Body, decoders: Sequence[Decoder], options: Options) -> PostureFilter | None:
    """Belief in the model's whole-body poses, where the decoder has probabilities and the session wants it."""
    windows = [decoder for decoder in decoders if isinstance(decoder, WindowDecoder)]
    if options.prior == "none" or not windows or not windows[0].ring.sums:
        return None
    lattices = [decoder.chain.lattice for decoder in windows]
    key = (PostureFilter, *(lattice.shape for lattice in lattices))
    postures = body.artifact.once(key, lambda: postures_of(body, lattices))
    return None if postures is None else PostureFilter(postures)


def _window_decoder(body: Body, machine: int, first: Mask, options: Options, noise: float) -> WindowDecoder:
    tables, graph, ring = body.machines[machine], body.graphs[machine], SEMIRINGS[options.decoder]
    lever = float(body.levers[machine].max(initial=0.0))
    lattice = machine_lattice(body.artifact, body.chain, tables, lever, noise)
    motion = _motion(body, tables, graph)
    chain = _chain(lattice, tables, graph, ring, motion)
    ages = _ages(body, tables, chain.state, ring)
    tracer = _chain(lattice, tables, graph, TRACED, motion) if options.decoder == "viterbi" else None
    return WindowDecoder(tables, chain, body.levers[machine], first, options.sure, ages, tracer)


def _ages(body: Body, tables: MachineTables, state: Ids | None, ring: Semiring) -> Ages | None:
    """The bounds on the time in a machine's states, over entries of states (n_entry,), or over the states."""
    n_state = len(tables.state_names)
    bounds = bounds_of(body.artifact.manifest.dwell, tables.name, n_state)
    return None if bounds is None else ages_of(bounds, np.arange(n_state) if state is None else state, ring)


def _motion(body: Body, tables: MachineTables, graph: Graph) -> MotionParameters:
    """How the machine moves: as this person does, where the model is baked for one."""
    usual = CURVE_MOTION if graph.rounds_up else MotionParameters()
    return person_motion(body.artifact.manifest.profile, tables.name, usual)


def _chain(lattice: Lattice, tables: MachineTables, graph: Graph, ring: Semiring, motion: MotionParameters) -> Chain:
    if lattice.axes:
        return LatticeChain(lattice, ring, motion, graph)
    return CurveChain(lattice, ring, tables, motion) if graph.rounds_up else GraphChain(lattice, ring, graph, motion)
