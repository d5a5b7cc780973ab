"""Whether `make soak` runs the tests: then they take as long as they need."""

from hypothesis import settings

# The profile "soak" is chosen on pytest's command line, before tests are collected.
SOAK = settings().max_examples >= 1000
