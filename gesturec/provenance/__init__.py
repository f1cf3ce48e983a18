"""Where effective values come from: `origins` follows one through templates, mirrors, includes and settings."""

from gesturec.provenance.origin import origins
from gesturec.provenance.record import Origin, Trace

__all__ = ["Origin", "Trace", "origins"]
