"""What a frame's answer may say about itself, declared once.

`Step.status` and `Decoding.status` hold one word a frame; a machine's own word is in `Step.why`. Where
several apply to a frame, the one that comes later in `STATUSES` is told, so the table is also the order
of gravity. None of them is an exception: after construction a session never raises for what it is fed.
"""

from __future__ import annotations

from typing import Final, NamedTuple


class Status(NamedTuple):
    """A word that a frame or a machine may get: what it says, and what a reader makes of it."""

    name: str
    doc: str
    help: str


STATUSES: Final = (
    Status(
        "ok",
        "every machine has a decided state that its tokens support",
        "The state is as sure as its probability; `delay` says how many later frames it waited for.",
    ),
    Status(
        "partial",
        "some machine has hidden tokens; what is seen supports its state",
        "The state rests on fewer tokens than usual; the candidates say whether others fit as well.",
    ),
    Status(
        "coasting",
        "some machine is not seen at all; its state is carried on from the last that was",
        "The state is a guess from how long it was held; `forward` tells in its probability how it becomes less sure.",
    ),
    Status(
        "any",
        "nothing of some machine is seen, or only what its candidates share; none is chosen",
        "Nothing in the recording tells the candidates apart. Leave the frame out, or use the set as it is.",
    ),
    Status(
        "undecided",
        "what is seen of some machine fits states that cannot be told apart surely, or be reached yet",
        "Use the candidates; a longer `--lag` lets later frames decide, and a lower `--sure` tells the most probable.",
    ),
    Status(
        "partly-misfit",
        "tokens of some machine, not of most, fit no state of it; the others are as they say",
        "See that machine's chi-square beside its limit: one wrong point, or another limb (`gesturec fit`).",
    ),
    Status(
        "misfit",
        "a machine's tokens fit no state; of a frame, most machines': another body or hand, wrong points",
        "In a few frames: outliers. In most: the other side (`--set side=...`), unit (`--units`) or names (`--bind`).",
    ),
    Status(
        "lost",
        "some machine was not seen or not supported for over 1 s, and nearly every state is possible again",
        "What was believed of it is forgotten; its next tokens decide as if the take began there.",
    ),
    Status(
        "pose-held",
        "fewer than three root tokens: the pose is carried on, or found by where limbs are believed",
        "States are still decided, from where the root is expected; they are less sure the longer this lasts.",
    ),
    Status(
        "pose-unknown",
        "no pose: too few root tokens, or too far apart in time",
        "Without the intrinsic frame no limb can be judged; three root tokens in one frame bring it back.",
    ),
    Status(
        "no-tokens",
        "nothing that the model knows was seen in this frame",
        "In a gap that is as it should be. In a whole take no name fits: see `gesturec info` and `--bind`.",
    ),
    Status(
        "time-refused",
        "the frame's time was repeated, earlier or no number; the frame changed nothing",
        "Times must rise; `message` in OUT.jsonl says which two did not.",
    ),
    Status(
        "input-refused",
        "the points had another shape or names than the binding's; the frame changed nothing",
        "`message` in OUT.jsonl says what came and what was expected.",
    ),
    Status(
        "starting",
        "no frame is due yet: the lag has not filled",
        "Live sessions alone say it, in the first steps; files have no such frame.",
    ),
)
STATUS_ID: Final = {status.name: index for index, status in enumerate(STATUSES)}


def gravest(names: tuple[str, ...]) -> str:
    """The word that a frame is given when all of `names` apply; ``ok`` when none does."""
    return max(names, key=STATUS_ID.__getitem__, default="ok")
