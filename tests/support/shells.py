"""The shells of the studio, a server and a site, and which tests of its page run against which of them.

`make soak` runs all tests of the page against both, except those that need what a site hasn't. `make test` runs them
against the server; `test_site.py`, `test_offline.py` and `test_same_bits.py` know the site alone.
"""

# What only a server has, and the tests that need it.
SERVER_ALONE = {
    "a server that ends and comes back": ("test_work_continues_after_the_server_crashed_and_came_back",),
    "a build of its own": ("test_a_third_language_is_one_file",),
    "the page that drives the cars of a world": ("test_the_leader_of_a_swarm_is_driven_while_its_followers_hear_it",),
}


def shells_of(test: str) -> list[str]:
    """The shells against which a test runs, by its function's name."""
    # Not above: conftest.py imports this file before pytest chooses the profile.
    from support.soak import SOAK

    if any(test in tests for tests in SERVER_ALONE.values()):
        return ["server"]
    return ["server", "site"] if SOAK else ["server"]
