"""Pictures: one HTML page of a decoded take (`page`), and a machine's graph in many formats (`graph`).

In: an `Artifact`, and for the page a `Decoding`. Out: text. Needs numpy alone.
"""
