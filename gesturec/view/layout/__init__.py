"""Where the states of a machine are drawn: `layout_graph` is the entry, `GraphLayout` the product."""

from gesturec.view.layout.lay_out import MOST_STATES, layout_graph
from gesturec.view.layout.types import GraphLayout, Panel, Shape, Text

__all__ = ["MOST_STATES", "GraphLayout", "Panel", "Shape", "Text", "layout_graph"]
