"""Bytes to and from a car."""
