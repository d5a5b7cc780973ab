"""What a run was: recordings, replay, pictures, films."""
