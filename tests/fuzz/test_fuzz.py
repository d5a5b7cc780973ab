"""What comes from others, a little of it; `python -m tests.fuzz` and `make soak` try much more."""

import pytest
from tests.fuzz.corpus import corpus
from tests.fuzz.harnesses import HARNESSES


@pytest.mark.parametrize("name", HARNESSES)
def test_whatever_comes_is_taken_or_refused_in_a_sentence(name):
    harness = HARNESSES[name]
    for data in corpus(name):
        harness.hypothesis.fuzz_one_input(data)
    harness()
