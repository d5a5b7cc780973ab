"""The profile's integers for the brain."""

from motorcade.car.board import make_levels
from motorcade.config.profile import Profile


def levels_of(profile: Profile) -> tuple[int, ...]:
    """What `motorcade.car.brain` takes as ``levels``."""
    infrared = profile.infrared
    return make_levels(
        profile.durations_ms,
        profile.dwell_ms,
        profile.avoid_radii_mm,
        profile.idle_state_ms,
        infrared.unit_us,
        infrared.gap_ms,
        infrared.relay_period_ms,
        infrared.sense_ms,
    )
