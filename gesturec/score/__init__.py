"""How well a decoding agrees with the truth or with another coder: states, sets, pose and events.

`score` reads the files and returns a `ScoreReport`; the other files each hold one measure.
Needs numpy and the standard library alone.
"""

from gesturec.score.report import ScoreReport
from gesturec.score.scoring import score

__all__ = ["ScoreReport", "score"]
