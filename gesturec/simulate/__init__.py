"""Takes made by the model itself: an artifact and a path of poses in, a `Recording` and its truth out."""
