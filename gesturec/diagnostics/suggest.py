"""The nearest name: what the author probably meant.

In: a word that is not known and the words that are. Out: the nearest of them, or None where none is near.
The distance is the optimal string alignment distance (insert, delete, replace, swap two neighbours: the four
slips of one finger), taken without case, because a wrong case is the smallest slip of all.
"""

from __future__ import annotations

from collections.abc import Iterable

# Longer words would cost time and are never slips of a finger.
LONGEST_WORD = 80


def edit_distance(a: str, b: str, most: int) -> int:
    """Optimal string alignment distance of two words, or `most + 1` where it is larger than `most`."""
    if abs(len(a) - len(b)) > most:
        return most + 1
    before, row = [0] * (len(b) + 1), list(range(len(b) + 1))
    for i, char in enumerate(a, 1):
        older, before, row = before, row, [i]
        for j, other in enumerate(b, 1):
            cost = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (char != other))
            if i > 1 and j > 1 and char == b[j - 2] and a[i - 2] == other:
                cost = min(cost, older[j - 2] + 1)
            row.append(cost)
        if min(row) > most:
            return most + 1
    return row[-1]


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word that is nearest to `word`: one slip in a short word, two in a longer one.

    Of several as near it is one of the same letters, as a letter struck twice or two swapped bring in no other; then
    one of about the same length.
    """
    if len(word) > LONGEST_WORD:
        return None
    most = 1 if len(word) < 5 else 2
    lower = word.lower()
    # A word that has no letter of another is no slip of it: `p` is not `a`.
    candidates = [other for other in set(known) if set(lower) & set(other.lower())]
    distances = {other: edit_distance(lower, other.lower(), most) for other in candidates}
    near = [other for other, distance in distances.items() if distance <= most]
    return min(
        near,
        key=lambda other: (distances[other], set(lower) != set(other.lower()), abs(len(other) - len(word)), other),
        default=None,
    )


def did_you_mean(word: str, known: Iterable[str]) -> str | None:
    """The help line for a word that is not known: the nearest, else what there is where that is short."""
    names = sorted(set(known))
    near = nearest(word, names)
    if near is not None:
        return f"did you mean `{near}`?"
    if 0 < len(names) <= 12:
        return "there is " + ", ".join(f"`{name}`" for name in names)
    return None
