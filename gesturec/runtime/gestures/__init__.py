"""Gestures: what the truths of decided frames, one after the other, add up to.

In: the gestures of the manifest and, frame by frame, how true each of their truths is. Out: `GestureEvent`s.
`truths` tells how true; `episodes` makes beginnings and ends of that; `automaton` is a pattern as a graph of its
steps; `matching` walks it; `run` is what a session holds.
"""
