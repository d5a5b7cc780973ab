"""Servers of pages: the studio, and the remote that drives cars."""
