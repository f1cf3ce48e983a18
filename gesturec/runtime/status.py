"""What a frame's answer may say about itself, declared once.

`Step.status` and `Decoding.status` hold one word a frame; a machine's own word is in `Step.why`. Where
several apply to a frame, the one that comes later in `STATUSES` is told, so the table is also the order
of gravity. None of them is an exception: after construction a session never raises for what it is fed.
"""

from __future__ import annotations

from typing import Final, NamedTuple


class Status(NamedTuple):
    """A word that a frame or a machine may get."""

    name: str
    doc: str


STATUSES: Final = (
    Status("ok", "every machine has a decided state that its tokens support"),
    Status("partial", "some machine has hidden tokens; what is seen supports its state"),
    Status("coasting", "some machine is not seen at all; its state is carried on from the last that was"),
    Status("any", "nothing of some machine is seen, or only what its candidates share; none is chosen"),
    Status("undecided", "what is seen of some machine fits states that cannot be told apart surely, or be reached yet"),
    Status("partly-misfit", "tokens of some machine, not of most, fit no state of it; the others are as they say"),
    Status("misfit", "a machine's tokens fit no state; of a frame, most machines': another body or hand, wrong points"),
    Status("lost", "some machine was not supported for longer than `patience`: every state is possible again"),
    Status("pose-held", "fewer than three root tokens: the pose is carried on, or found by where limbs are believed"),
    Status("pose-unknown", "no pose: too few root tokens, or too far apart in time"),
    Status("no-tokens", "nothing that the model knows was seen in this frame"),
    Status("time-refused", "the frame's time was repeated, earlier or no number; the frame changed nothing"),
    Status("input-refused", "the points had another shape or names than the binding's; the frame changed nothing"),
    Status("starting", "no frame is due yet: the lag has not filled"),
)
STATUS_ID: Final = {status.name: index for index, status in enumerate(STATUSES)}


def gravest(names: tuple[str, ...]) -> str:
    """The word that a frame is given when all of `names` apply; ``ok`` when none does."""
    return max(names, key=STATUS_ID.__getitem__, default="ok")
