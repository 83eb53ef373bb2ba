"""Procedural worlds to render: campus, town and meadow, with their textures, geometry and courses."""
