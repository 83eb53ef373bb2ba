"""A procedural campus: its textures, its geometry and the drive around its main building."""
