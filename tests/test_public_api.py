"""What `import gesturec` shows: about fifteen names, sorted, each where it says it is."""

from __future__ import annotations

import gesturec


def test_all_is_sorted_and_is_all_that_is_visible() -> None:
    assert list(gesturec.__all__) == sorted(gesturec.__all__)
    assert dir(gesturec) == gesturec.__all__
    assert len(gesturec.__all__) <= 20


def test_every_name_is_there() -> None:
    for name in gesturec.__all__:
        assert getattr(gesturec, name) is not None
    assert not hasattr(gesturec, "no_such_name")


def test_every_exception_is_one_of_ours() -> None:
    for name in ("ModelError", "ArtifactError", "InputError", "LimitError"):
        assert issubclass(getattr(gesturec, name), gesturec.GesturecError)
