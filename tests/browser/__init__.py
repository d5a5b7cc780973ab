"""Tests of the pages in a browser. A package, so that a browser of the scope package ends with it."""
