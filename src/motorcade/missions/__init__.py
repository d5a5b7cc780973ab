"""Missions: tasks with goals that a run is checked against, on the command line and in the page alike."""
