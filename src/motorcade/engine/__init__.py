"""A world for many cars, and a car that exists only in software."""
