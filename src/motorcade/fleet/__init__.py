"""Many cars: find them, tell them apart, load and stop them all."""
