"""A simulated microcontroller and the parts of a car at its pins; portable, as what runs on it."""
