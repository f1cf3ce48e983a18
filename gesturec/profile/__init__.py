"""Profiles: what was estimated of one person, as a file, and as another body for a compiled model."""
