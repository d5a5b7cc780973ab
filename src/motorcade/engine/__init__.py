"""Simulate many cars on a mat; `motorcade.engine.world.World` is the public interface."""
