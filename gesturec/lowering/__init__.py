"""A `ResolvedBody` becomes a `LoweredModel`: SI, dense ids; templates, mirrors, scale and names are gone."""
