"""What is wrong with a world, in sentences; apart, so that naming these errors needs no NumPy."""


class MatError(ValueError):
    """A mat that isn't there, can't be read or can't be."""


class WorldError(ValueError):
    """A world that can't be: its cars, images or profile don't fit it, or the memory."""
