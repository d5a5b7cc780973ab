"""What stops a car whose driver or program is gone."""
