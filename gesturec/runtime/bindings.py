"""Names of a recording's points → the model's tokens, at run time.

In: the model's token names and bindings (from the manifest), what the user asked for, and the names that
the points have. Out: a `Plan`, which turns a frame's rows into one row a token. A binding gives a token
one name, a list (its mean, seen when all are) or weights that sum to one. Names match exactly, else
without case, else without a ``subject:`` before them; a name that two points answer to is an error.
Without a choice the model's own names are tried, then the binding that names most of what is there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gesturec.artifact.manifest import UPWARDS, WEIGHT_SUM_TOLERANCE
from gesturec.diagnostics.suggest import did_you_mean

Array = NDArray[np.float64]
Weights = dict[str, float]
OWN_NAMES: Final = "own names"
KEYS: Final = ("tokens", "order", "up")  # of a mapping that says more than tokens


@dataclass(frozen=True)
class Binding:
    """Which of their points make up each of our tokens; `order` names the rows of bare arrays."""

    name: str
    tokens: Mapping[str, Weights]
    order: tuple[str, ...] = ()
    up: str | None = None


@dataclass(frozen=True, eq=False)
class Plan:
    """A binding applied to named points.

    Attributes
    ----------
    token, point, weight
        One row a term: token `token` gets `weight` of point `point`, each of shape (n_term,).
    n_token, n_point
        Rows that come out, rows that go in.
    unmatched
        Names of the binding that no point has.
    ignored
        Points that nothing uses.
    """

    binding: Binding
    names: tuple[str, ...]
    token: NDArray[np.int64]
    point: NDArray[np.int64]
    weight: Array
    n_token: int
    n_point: int
    unmatched: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()

    def apply(self, points: Array) -> Array:
        """Rows of points, shape (n_point, 3), as rows of tokens, shape (n_token, 3); NaN is not seen."""
        tokens = np.full((self.n_token, 3), np.nan)
        tokens[self.token] = 0.0
        np.add.at(tokens, self.token, self.weight[:, None] * points[self.point])
        return tokens

    def apply_covariance(self, covariance: Array) -> Array:
        """The same for covariances (n_point, 3, 3), the points' errors being independent."""
        tokens = np.full((self.n_token, 3, 3), np.nan)
        tokens[self.token] = 0.0
        np.add.at(tokens, self.token, (self.weight**2)[:, None, None] * covariance[self.point])
        return tokens


def resolve_binding(manifest: Any, bind: str | Mapping[str, Any] | None, names: Sequence[str]) -> Plan:
    """The plan for points called `names`.

    Raises
    ------
    ValueError
        For an unknown binding, a name that two points answer to, or two bindings that fit alike.
    """
    asked = asked_binding(manifest, bind)
    return choose_binding(manifest, names) if asked is None else plan(asked, manifest.tokens, names)


def asked_binding(manifest: Any, bind: str | Mapping[str, Any] | None) -> Binding | None:
    """The binding of that name, or that a user's mapping is; None where none is asked for."""
    if bind is None:
        return None
    return parse_binding("given", bind, manifest.tokens) if isinstance(bind, Mapping) else _named(manifest, bind)


def choose_binding(manifest: Any, names: Sequence[str]) -> Plan:
    """Own names if they name all or most of the points, else the binding that names most."""
    plans = [plan(binding, manifest.tokens, names) for binding in candidate_bindings(manifest)]
    counts = [_used(p) for p in plans]
    if max(counts) == 0:
        raise ValueError(
            f"no binding names any of the points: {_some(names)}; own tokens: {_some(manifest.tokens)}; "
            f"bindings: {_some([p.binding.name for p in plans[1:]]) or 'none'}"
        )
    if counts[0] == max(counts):
        return plans[0]
    best = [p for p, count in zip(plans, counts, strict=True) if count == max(counts)]
    if len(best) > 1:
        raise ValueError(f"bindings {_some([p.binding.name for p in best])} fit the points alike: choose one")
    return best[0]


def bind_rows(manifest: Any, n_point: int, asked: Binding | None) -> Plan:
    """The plan for bare rows without names: the one binding, or the model itself, that has so many."""
    if asked is not None:
        raise ValueError(f"the binding `{asked.name}` has no `order`, so that rows without names fit nothing")
    if n_point == len(manifest.tokens):
        return plan(own_binding(manifest), manifest.tokens, manifest.tokens)
    fitting = [b for b in candidate_bindings(manifest) if len(b.order) == n_point]
    if not fitting:
        raise ValueError(f"{n_point} rows without names fit no binding by its `order`")
    if len(fitting) > 1:
        found = _some([b.name for b in fitting])
        raise ValueError(f"{n_point} rows without names fit {found} by their `order`: choose one (`bind`)")
    return plan(fitting[0], manifest.tokens, fitting[0].order)


def plan_rows(used: Plan, tokens: Sequence[str]) -> Plan:
    """The plan for bare rows where points with names have shown the binding; without an order, as those were."""
    own = tuple(tokens) if used.binding.name == OWN_NAMES else used.names
    return plan(used.binding, tokens, used.binding.order or own)


def candidate_bindings(manifest: Any) -> list[Binding]:
    """The model's own names, then its bindings."""
    declared = [
        parse_binding(str(b["name"]), {key: b[key] for key in KEYS if key in b}, manifest.tokens)
        for b in manifest.bindings
    ]
    return [own_binding(manifest), *declared]


def own_binding(manifest: Any) -> Binding:
    """Every token under its own name."""
    return Binding(OWN_NAMES, {token: {token: 1.0} for token in manifest.tokens}, ())


def parse_binding(name: str, given: Mapping[str, Any], tokens: Sequence[str]) -> Binding:
    """A binding as the manifest or a user's mapping has it; bare ``{ours: theirs}`` is taken too."""
    whole = "tokens" in given and not isinstance(given["tokens"], str)
    entries = given["tokens"] if whole else given
    if not isinstance(entries, Mapping):
        entries = {token: token for token in entries}
    if whole:
        _refuse_unknown([key for key in given if key not in KEYS], f"binding `{name}` has no key", KEYS)
    told = f"binding `{name}` names tokens that the model does not have:"
    _refuse_unknown([t for t in entries if t not in tokens], told, tokens if whole else (*tokens, *KEYS))
    up = given.get("up") if whole else None
    if up is not None and up not in UPWARDS:
        raise ValueError(f"binding `{name}`: `up` is `{up}`, which is none of {', '.join(UPWARDS)}")
    order = tuple(str(n) for n in (given.get("order") or ())) if whole else ()
    return Binding(name, {str(k): _weights(name, str(k), v) for k, v in entries.items()}, order, up)


def _refuse_unknown(unknown: Sequence[Any], told: str, known: Sequence[str]) -> None:
    """ValueError with the names that nothing knows, and what the first of them may have been meant to be."""
    if unknown:
        help = did_you_mean(str(unknown[0]), known)
        raise ValueError(f"{told} {_some(unknown)}" + (f"; {help}" if help else ""))


def plan(binding: Binding, tokens: Sequence[str], names: Sequence[str]) -> Plan:
    """Match the binding's names to the points' and list every token's terms."""
    wanted = {theirs for weights in binding.tokens.values() for theirs in weights}
    found = match_names(wanted, names)
    rows: list[tuple[int, int, float]] = []
    for ours, weights in binding.tokens.items():
        if all(theirs in found for theirs in weights):
            rows += [(tokens.index(ours), found[theirs], weight) for theirs, weight in weights.items()]
    used = {point for _, point, _ in rows}
    return Plan(
        binding,
        tuple(names),
        np.array([r[0] for r in rows], dtype=np.int64),
        np.array([r[1] for r in rows], dtype=np.int64),
        np.array([r[2] for r in rows], dtype=np.float64),
        len(tokens),
        len(names),
        tuple(sorted(wanted - found.keys())),
        tuple(name for i, name in enumerate(names) if i not in used),
    )


def match_names(wanted: Iterable[str], names: Sequence[str]) -> dict[str, int]:
    """Index in `names` of every wanted name that is there, by the first of three rules that finds one."""
    indexes = [_index(names, rule) for rule in _RULES]
    found = {}
    for name in sorted(wanted):
        for rule, index in zip(_RULES, indexes, strict=True):
            places = index.get(rule(name), [])
            if len(places) > 1:
                raise ValueError(
                    f"`{name}` could be any of {_some([names[p] for p in places])}: bind one by its full name"
                )
            if places:
                found[name] = places[0]
                break
    return found


def _without_subject(name: str) -> str:
    return name.rsplit(":", 1)[-1].casefold()


_RULES: Final[tuple[Callable[[str], str], ...]] = (str, str.casefold, _without_subject)


def _index(names: Sequence[str], rule: Callable[[str], str]) -> dict[str, list[int]]:
    index: dict[str, list[int]] = {}
    for place, name in enumerate(names):
        index.setdefault(rule(name), []).append(place)
    return index


def _weights(binding: str, token: str, given: Any) -> Weights:
    """One entry: a name, a list, or weights that sum to one."""
    if isinstance(given, str):
        return {given: 1.0}
    if isinstance(given, Mapping):
        weights = {str(k): float(v) for k, v in given.items()}
    else:
        weights = {str(k): n / len(given) for k, n in Counter(given).items()}
    if not weights or abs(sum(weights.values()) - 1) > WEIGHT_SUM_TOLERANCE:
        raise ValueError(f"binding `{binding}`: the weights of `{token}` sum to {sum(weights.values()):g}, not to 1")
    return weights


def _named(manifest: Any, name: str) -> Binding:
    for binding in candidate_bindings(manifest)[1:]:
        if binding.name == name:
            return binding
    known = _some([str(b["name"]) for b in manifest.bindings]) or "none"
    raise ValueError(f"the model has no binding `{name}`; it has: {known}")


def _used(p: Plan) -> int:
    return p.n_point - len(p.ignored)


def _some(names: Sequence[str], limit: int = 6) -> str:
    shown = ", ".join(f"`{n}`" for n in names[:limit])
    return shown + (f" and {len(names) - limit} more" if len(names) > limit else "")
