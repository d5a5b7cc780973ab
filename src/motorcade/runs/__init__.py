"""What a run was: recordings, replay, plots, films."""
