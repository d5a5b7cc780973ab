"""What all tests share."""

from hypothesis import settings

# The same examples every time, so that a failure is the change's and not the day's; `make soak` goes further.
settings.register_profile("quick", deadline=None, derandomize=True)
settings.register_profile("soak", deadline=None, max_examples=1_000)
settings.load_profile("quick")
