"""The experiments of docs/lab, small, and in soak whole: simulation agrees with theory where the page says so.

A point may be beyond the stated part of theory by four standard errors. With the normal distribution, and 60 points,
one run of these tests in 260 would fail by chance; the seeds are fixed, so the same points pass each time.
"""

import numpy as np
from benchmarks import theory

from support.soak import SOAK

MOST_ERRORS = 4


def agrees(series, share, least=0.0):
    return bool((series.beyond(share, least) <= MOST_ERRORS).all())


def test_throughput_is_that_of_aloha_with_so_many_senders():
    periods_ms = theory.PERIODS_MS if SOAK else (200, 700, 2_500)
    any_time, half_frames = theory.aloha(20 if SOAK else 6, 60 if SOAK else 20, periods_ms)
    assert agrees(any_time, 0.02)
    assert agrees(half_frames, 0.02)
    # Neither theory would do for the other.
    assert not agrees(theory.replace(any_time, theory=any_time.limits["any-time-limit"] * 1.3), 0.02)
    best = {each.key: each.mean.max() for each in (any_time, half_frames)}
    assert best["half-frames"] > 1.2 * best["any-time"]


def test_a_word_reaches_the_cluster_of_discs_that_its_leader_belongs_to():
    runs, ranges_mm = (30, theory.RANGES_MM) if SOAK else (4, (300, 460, 600))
    (word,) = theory.percolation(runs, ranges_mm, 200 if SOAK else 60)
    assert np.allclose(word.mean, word.limits["word-limit"], atol=0.002)
    assert agrees(word, 0.0)


def test_a_word_that_is_told_rarely_spreads_like_a_logistic_epidemic():
    runs, points = (10, 10) if SOAK else (4, 5)
    rare, *often = theory.epidemic(runs, ("rare", "often") if SOAK else ("rare",), points)
    assert agrees(rare, 0.0, least=0.03)
    # Where cars tell it faster than they mix, it is slower than the theory.
    assert all((each.mean < each.theory - 0.02)[1:8].all() for each in often)


def test_wandering_cars_diffuse_like_bacteria_that_run_and_tumble():
    (wanders,) = theory.diffusion(None if SOAK else 150)
    assert agrees(wanders, 0.0)


def test_the_messages_of_trickle_grow_with_the_logarithm_of_the_number_of_cars():
    for each in theory.trickle(None if SOAK else 4):
        assert agrees(each, 0.05)
        # Ten times as many cars cost a constant number of messages more.
        steps = np.diff(each.theory) / np.diff(np.log(each.x))
        assert steps[-1] / steps[3] < 1.2
